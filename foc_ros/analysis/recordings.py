"""The recordings of a folder, bags or CSV tables alike, as streams of recorded messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from foc_ros.core.errors import FocError, RecordingError, collect, join_errors
from foc_ros.io.bags import BagReader, Item, check_bag, is_bag_file
from foc_ros.io.csv_tables import Row

from .box_scenes import BoxScenes, read_picked
from .csv_recordings import (
    Movement,
    RecordedScene,
    SceneTables,
    parse_movement,
    read_movement_rows,
    read_scenes,
    recorded_messages,
    warn_of_doubts,
)

RECORDINGS, OBSTACLES, GOALS, LABELS = 'recordings.csv', 'obstacles.csv', 'goals.csv', 'labels.csv'
SCENES, TRIALS = 'scenes.csv', 'trials.csv'


@dataclass(frozen=True)
class BagRecording:
    """A bag; path: its directory, or one file."""

    name: str
    path: Path
    goal: ClassVar[None] = None

    def items(self) -> Iterator[Item]:
        """Yield the recorded messages; raises RecordingError, also for a recording of which only a part can be read."""
        with BagReader(self.path, is_whole=True) as reader:
            yield from reader


@dataclass(frozen=True)
class TableRecording:
    """One recording of a table; movement: the movement, or the error of its rows; other recordings are not affected."""

    name: str
    movement: Movement | RecordingError
    scene: RecordedScene

    @property
    def goal(self) -> int | None:
        """Row of the goal that was reached, None where no table says it."""
        return self.scene.goal

    def read_movement(self) -> Movement:
        """Return the movement of the hand; raises RecordingError."""
        if isinstance(self.movement, RecordingError):
            raise self.movement
        return self.movement

    def items(self) -> Iterator[Item]:
        """Yield the messages that `convert` would write; raises RecordingError."""
        for stamp_ns, topic, message in recorded_messages(self.read_movement(), self.scene):
            yield Item(topic.removeprefix('/'), topic, stamp_ns, message, b'')


Recording = BagRecording | TableRecording


def find_recordings(data: Path) -> dict[str, Recording]:
    """Return the recordings of a folder by name.

    data: a folder with recordings.csv, and either goals.csv and, where there are obstacles, obstacles.csv, or scenes.csv with the
    boxes of each recording; a folder of bags; or a bag. Raises RecordingError where it is none of these.
    """
    if (data / RECORDINGS).exists():
        return dict(read_tables(data))
    if data.is_file() or ((data / 'metadata.yaml').exists() and any(map(is_bag_file, data.iterdir()))):
        check_bag(data)
        bags = [data.resolve()]
    elif data.is_dir():
        bags = [path for path in sorted(data.iterdir()) if _may_be_bag(path)]
    else:
        raise RecordingError(f'{data}: no such file or directory')
    if not bags:
        raise RecordingError(f'{data}: expected bags, or {RECORDINGS} with {GOALS} or {SCENES}, got neither')
    return {path.name: BagRecording(path.name, path) for path in bags}


def group_by_operator(found: Mapping[str, Recording]) -> dict[str, list[Recording]]:
    """Return the recordings of each operator, whose name is that of the recording up to its last underscore, in their order."""
    groups: dict[str, list[Recording]] = {}
    for name, recording in found.items():
        groups.setdefault(name.rpartition('_')[0], []).append(recording)
    return groups


def read_tables(data: Path) -> dict[str, TableRecording]:
    """Return the recordings of a folder of tables by name.

    Raises one RecordingError for the errors of all tables if a table has no scenes or no recording that can be used.
    """
    errors: list[FocError] = []
    scenes = collect(errors, _read_scenes, data)
    rows = collect(errors, read_movement_rows, data / RECORDINGS) or {}
    warn_of_doubts(data / RECORDINGS, rows)
    movements = {name: _parse_movement(name, each) for name, each in rows.items()}
    failures = [each for each in movements.values() if isinstance(each, RecordingError)]
    if scenes is None or len(failures) == len(movements):
        raise join_errors([*errors, *failures])
    return {name: TableRecording(name, movement, scenes.find(name)) for name, movement in movements.items()}


def _parse_movement(name: str, rows: Iterable[Row]) -> Movement | RecordingError:
    try:
        return parse_movement(name, rows)
    except RecordingError as error:
        return error


def _read_scenes(data: Path) -> SceneTables | BoxScenes:
    if (data / SCENES).exists():
        return BoxScenes(data / SCENES, read_picked(data / TRIALS) if (data / TRIALS).exists() else {})
    return read_scenes(data / OBSTACLES if (data / OBSTACLES).exists() else None, data / GOALS)


def _may_be_bag(path: Path) -> bool:
    """Tell bags from other files; a directory with bag files but without metadata counts, so that it is reported as broken."""
    if path.name.startswith('.'):
        return False
    return is_bag_file(path) or (path.is_dir() and any(map(is_bag_file, path.iterdir())))
