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
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS

from .figures import make_moment_figure
from .page import render_figure, render_pictures
from .report import ONSET_SPEED, ReportCollector
from .views import HandTrajectory, build_hand_trajectory, choose_moment

MOST_ITEMS = 3_000
"""Messages of a recording that are read at most."""
FEW = 20
"""Number of recordings below which the page warns."""


def warn_of_few(count: int, what: str) -> list[str]:
    """Return a warning where recordings or trials are few."""
    words = f'Few {what} ({count}): intervals are wide, and differences may be chance. {FEW} or more tell more.'
    return [words] if count < FEW else []


def render_example(recordings: Mapping[str, Recording], config: Config) -> str:
    """Return HTML with a picture of a moment of the first recording that can be replayed, '' if there is none."""
    for name, recording in recordings.items():
        collected = ReportCollector()
        try:
            for step in Replay(config).steps(islice(recording.items(), MOST_ITEMS)):
                collected.add(step)
        except FocError:
            continue  # the page lists what cannot be read
        hand = build_hand_trajectory(collected.samples)
        for span in hand.find_movements(ONSET_SPEED):
            row = choose_moment(collected.snapshots, *span)
            if row is not None:
                return '<h2>One recording with its prediction</h2>' + _render_moment(name, hand, collected.snapshots[row], span)
    return ''


def _render_moment(name: str, hand: HandTrajectory, snapshot: Prediction, span: tuple[int, int]) -> str:
    seconds = (snapshot.stamp_ns - span[0]) / NANOSECONDS
    caption = f'{name}, {seconds:.2f} s after the hand began to move.'
    return render_pictures([render_figure(make_moment_figure(hand, snapshot, span), caption)])
