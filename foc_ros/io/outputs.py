# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Files that a command may write: new files, and files that foc_ros has made before."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from foc_ros.core.errors import FocError, InputError

MARK = 'made by foc_ros'
"""Text that every picture and page contains that a command writes."""
EVALUATION_PAGE, FIT_PAGE, SIMULATION_PAGE = 'evaluation.html', 'fit.html', 'simulation.html'
REPORT_FILES = ('index.html', 'predictions.json')
PICTURE_SUFFIXES = ('.png', '.pdf', '.svg')


def check_file(option: str, file: Path) -> None:
    """Raise InputError, which names the option, if a file cannot be written into its folder, or the folder does not exist."""
    if file.is_dir() or not file.resolve().parent.is_dir():
        raise InputError(option, 'a file in a directory that exists', file)
    if not os.access(file if file.exists() else file.resolve().parent, os.W_OK):
        raise InputError(option, 'a file that can be written', file)


def check_new_or_earlier(option: str, file: Path, read: Callable[[Path], object]) -> None:
    """Raise InputError as `check_file` does, or if a file exists that is no earlier one of the command, by `read`."""
    check_file(option, file)
    try:
        if file.is_file() and file.stat().st_size:
            read(file)
    except FocError as error:
        raise InputError(option, 'a new file, or an earlier one of this kind', error) from error


def check_folder(option: str, directory: Path) -> None:
    """Raise InputError, which names the option, if a folder cannot be made, or cannot be written."""
    file = next((each for each in (directory, *directory.parents) if each.exists()), directory)
    if file.is_file():
        raise InputError(option, 'a folder', f'{file}, which is a file')
    if not os.access(file, os.W_OK):
        raise InputError(option, 'a directory that can be written', directory)


@contextmanager
def make_folder(option: str, directory: Path) -> Iterator[None]:
    """Make a folder; raise InputError, which names the option, where that or writing to it within the context is impossible."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise InputError(option, 'a folder that can be written', f'{directory}: {error.strerror}') from error


@contextmanager
def write_whole(file: Path) -> Iterator[Path]:
    """Yield the path of an unfinished file, which replaces the file, or what it links to, when the context ends well."""
    target = file.resolve()
    if target.exists() and not target.is_file():
        yield target
        return
    unfinished = target.with_name(f'{target.stem}.{os.getpid()}.unfinished{target.suffix}')  # another process may write its own
    try:
        yield unfinished
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def lock_folder(folder: Path, *, waits: bool = True) -> Iterator[None]:
    """Let one process at a time continue for a folder, where its file system can; unless it `waits`, raise BlockingIOError."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX if waits else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError:
            pass
        yield
    finally:
        os.close(descriptor)


def check_picture(option: str, file: Path) -> None:
    """Raise InputError, which names the option, if a picture has an unknown format, or would replace another file."""
    if file.suffix.lower() not in PICTURE_SUFFIXES:
        raise InputError(option, f'a name that ends in {", ".join(PICTURE_SUFFIXES)}', file)
    check_file(option, file)
    check_replaceable(option, file)


def check_page(option: str, directory: Path, *names: str) -> None:
    """Raise InputError, which names the option, if files cannot be written into a directory without harm to others."""
    check_folder(option, directory)
    check_replaceable(option, *(directory / name for name in names))


def check_replaceable(option: str, *files: Path) -> None:
    """Raise InputError, which names the option, if a file exists that does not contain `MARK`."""
    for file in files:
        if file.is_file() and MARK.encode() not in file.read_bytes():
            raise InputError(option, 'a new file, or one that foc_ros has made', f'{file}, which it has not made')
