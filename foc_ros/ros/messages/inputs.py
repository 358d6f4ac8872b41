"""Old place, to be removed."""

from .decode_poses import stamp_of as stamp_of
