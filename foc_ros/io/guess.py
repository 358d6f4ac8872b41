"""Old place of :func:`foc_ros.io.scene_file.guess_path`, to be removed."""

from .scene_file import guess_path as guess_path
