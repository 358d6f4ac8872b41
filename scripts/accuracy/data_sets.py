"""The recordings on which predictions are measured: of the demo, and of folders such as D3IL and HLP where they are present."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from foc_ros.analysis.recordings import Recording, find_recordings

from .page import ROOT

DEMO = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
SHARED = ROOT.parent / 'shared' / 'data'


@dataclass(frozen=True)
class DataSet:
    """Recordings by name."""

    name: str
    recordings: dict[str, Recording]

    def thin(self, every: int) -> DataSet:
        """Return the data set with every n-th recording only."""
        return DataSet(self.name, dict(list(self.recordings.items())[::every]))


def find_data_sets() -> list[Path]:
    """Return the packaged recording, and the folders of D3IL and HLP beside the checkout where they are present."""
    return [DEMO, *(SHARED / name for name in ('d3il_avoiding', 'hlp_reaching') if (SHARED / name).exists())]


def load_data_set(data: Path) -> DataSet:
    """Return the recordings of a bag or folder."""
    return DataSet(data.stem, find_recordings(data))
