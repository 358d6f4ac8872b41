"""The recordings of a folder, bags or CSV tables alike, as streams of recorded messages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from foc_ros.analysis.csv_recordings import messages, movement_of, movement_rows, read_goals, read_obstacles
from foc_ros.core.errors import RecordingError
from foc_ros.core.types import Array
from foc_ros.io.bags import BagReader, Item
from foc_ros.io.csv_tables import Row

RECORDINGS, OBSTACLES, GOALS, LABELS = 'recordings.csv', 'obstacles.csv', 'goals.csv', 'labels.csv'
BAG_SUFFIXES = ('.mcap', '.db3')


@dataclass(frozen=True)
class BagRecording:
    """A bag; path: its directory, or one file."""

    name: str
    path: Path

    def items(self) -> Iterator[Item]:
        """Yield the recorded messages; raises RecordingError."""
        with BagReader(self.path) as reader:
            yield from reader


@dataclass(frozen=True)
class TableRecording:
    """One recording of a table; its rows are judged when they are read, so that a bad one is the only one that fails."""

    name: str
    rows: tuple[Row, ...]
    obstacles: tuple[tuple[float, ...], ...]
    goals: Array

    def items(self) -> Iterator[Item]:
        """Yield the messages that `convert` would write; raises RecordingError."""
        for stamp_ns, topic, message in messages(movement_of(self.name, self.rows), list(self.obstacles), self.goals):
            yield Item(topic.removeprefix('/'), topic, stamp_ns, message, b'')


Recording = BagRecording | TableRecording


def find_recordings(data: Path) -> dict[str, Recording]:
    """Return the recordings of a folder by name.

    data: holds recordings.csv with goals.csv and, unless there are none, obstacles.csv; or bags; or is itself a bag. Raises
    RecordingError where it holds neither.
    """
    if (data / RECORDINGS).exists():
        return dict(_of_tables(data))
    if data.is_file() or (data / 'metadata.yaml').exists():
        return dict(_bags([data.resolve()]))
    if not data.is_dir():
        raise RecordingError(f'{data}: no such file or directory')
    bags = dict(_bags([path for path in sorted(data.iterdir()) if _may_be_bag(path)]))
    if not bags:
        raise RecordingError(f'{data}: expected bags, or {RECORDINGS} with {GOALS}, got neither')
    return bags


def _bags(paths: list[Path]) -> Iterator[tuple[str, Recording]]:
    for path in paths:
        yield path.name, BagRecording(path.name, path)


def _of_tables(data: Path) -> Iterator[tuple[str, Recording]]:
    obstacles = tuple(read_obstacles(data / OBSTACLES)) if (data / OBSTACLES).exists() else ()
    goals = read_goals(data / GOALS)
    for name, table in movement_rows(data / RECORDINGS).items():
        yield name, TableRecording(name, tuple(table), obstacles, goals)


def _may_be_bag(path: Path) -> bool:
    """Tell bags from what else lies in a folder; a directory without metadata is one, to be named as broken."""
    if path.name.startswith('.'):
        return False
    return path.suffix in BAG_SUFFIXES if path.is_file() else any(file.suffix in BAG_SUFFIXES for file in path.iterdir())
