"""Files that a command may write: new files, and files that foc_ros has made before."""

from __future__ import annotations

from pathlib import Path

from foc_ros.core.errors import InputError

MARK = 'made by foc_ros'
"""Text that every picture and page contains that a command writes."""


def check_page(option: str, directory: Path, page: str) -> None:
    """Raise InputError, which names the option, if a page cannot be written into a directory without harm to another file."""
    if directory.is_file():
        raise InputError(option, 'a folder', f'{directory}, which is a file')
    check_replaceable(option, directory / page)


def check_replaceable(option: str, *files: Path) -> None:
    """Raise InputError, which names the option, if a file exists that does not contain `MARK`."""
    for file in files:
        if file.is_file() and MARK.encode() not in file.read_bytes():
            raise InputError(option, 'a new file, or one that foc_ros has made', f'{file}, which it has not made')
