# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording with its prediction as a picture, for the pages about many recordings."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice

from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config
from foc_ros.core.errors import FocError
from foc_ros.core.types import NANOSECONDS

from .figures import make_moment_figure
from .page import Section, make_picture
from .report import ReportCollector
from .views import build_hand_trajectory, choose_moment

MOST_ITEMS = 3_000
"""Messages of a recording that are read at most."""
FEW = 20
"""Number of recordings below which the page warns."""


def warn_of_few(count: int, what: str) -> list[str]:
    """Return a warning where recordings or trials are few."""
    words = f'Few {what} ({count}): intervals are wide, and differences may be chance. {FEW} or more tell more.'
    return [words] if count < FEW else []


def draw_example(recordings: Mapping[str, Recording] | None, config: Config | None) -> list[Section]:
    """Return a section with a moment of the first recording that can be replayed, nothing if there is none."""
    for name, recording in (recordings or {}).items():
        collected = ReportCollector()
        try:
            for step in Replay(config or Config()).steps(islice(recording.items(), MOST_ITEMS)):
                collected.add(step)
        except FocError:
            continue  # the page lists what cannot be read
        hand = build_hand_trajectory(collected.samples)
        for span in hand.find_movements():
            row = choose_moment(collected.snapshots, *span)
            if row is not None:
                snapshot = collected.snapshots[row]
                words = f'{name}, {(snapshot.stamp_ns - span[0]) / NANOSECONDS:.2f} s after the hand began to move.'
                picture = make_picture(make_moment_figure(hand, snapshot, span), words)
                return [Section('One recording with its prediction', pictures=[picture])]
    return []
