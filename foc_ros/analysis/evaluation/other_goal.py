# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A goal that nobody announced, tried out: each recording is replayed again with its goal left out of the list.

The share `other` is then right in the second replay and wrong in the first. It is judged by the area under the curve of the
receiver operating characteristic, half way and over all predictions, and by its calibration error: the mean distance of share and
frequency over ten bins, with the replays without the goal as frequent as `likelihood.other_goal` says. The loss is what the share
costs where the goal is on the list, the mean of -log(1 - other).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import mannwhitneyu

from foc_ros.analysis.recordings import Recording, TableRecording
from foc_ros.analysis.scenes import NO_GOAL
from foc_ros.core.learning.movements import find_reached_goal
from foc_ros.core.types import Array

from .observations import ObservedRecording
from .scores import BINS

HALF_WAY = 0.5


def leave_goals_out(recordings: Mapping[str, Recording]) -> dict[str, Recording]:
    """Return the recordings of tables that have several goals without the goal that was reached; the others are left away."""
    found: dict[str, Recording] = {}
    for name, each in recordings.items():
        if not isinstance(each, TableRecording) or each.scene.goals is None or len(each.scene.goals) < 2:
            continue
        goal = each.goal
        if goal is None:
            goal = find_reached_goal(each.read_movement().positions[:, :2], each.scene.goals[:, :2])[0]
        if goal is not None:
            found[name] = replace(each, scene=replace(each.scene, goals=np.delete(each.scene.goals, goal, axis=0), goal=NO_GOAL))
    return found


def score_other_goal(
    announced: Sequence[ObservedRecording], left_out: Sequence[ObservedRecording], prior: float
) -> dict[str, float] | None:
    """Return the scores of the share `other`, None where no recording was replayed both ways or the prior is zero.

    announced, left_out: the same recordings with all goals and without the right one; prior: `likelihood.other_goal`.
    """
    without = {each.name: {seen.stamp_ns: seen.other for seen in each.observations} for each in left_out}
    rows = []
    for recording in announced:
        stamps = without.get(recording.name, {})
        seen = [each for each in recording.observations if each.stamp_ns in stamps]
        half = next((row for row, each in enumerate(seen) if each.truth.progress >= HALF_WAY), len(seen) - 1)
        rows += [(each.other, stamps[each.stamp_ns], row == half) for row, each in enumerate(seen)]
    if not rows or not prior:
        return None
    wrong, right, is_half = np.array(rows, dtype=float).T
    half_way = is_half > 0.0
    return {
        'area_under_curve_half_way': _measure_area(wrong[half_way], right[half_way]),
        'area_under_curve': _measure_area(wrong, right),
        'calibration_error': _measure_calibration(wrong, right, prior),
        'loss': float(-np.log1p(-wrong).mean()),
        'share': float(wrong.mean()),
        'share_left_out': float(right.mean()),
    }


def _measure_area(wrong: Array, right: Array) -> float:
    """Return the probability that a share where it is right is larger than one where it is wrong, a tie counting half."""
    return float(mannwhitneyu(right, wrong).statistic) / (len(wrong) * len(right))


def _measure_calibration(wrong: Array, right: Array, prior: float) -> float:
    """Return the calibration error over bins of the share, where the right ones have the weight `prior` in all."""
    share, weight = np.concatenate([wrong, right]), np.repeat([(1.0 - prior) / len(wrong), prior / len(right)], len(wrong))
    number = np.minimum((share * BINS).astype(int), BINS - 1)
    expected = np.bincount(number, weight * share, BINS)
    happened = np.bincount(number[len(wrong) :], weight[len(wrong) :], BINS)
    return float(np.abs(expected - happened).sum())


def describe_scores(scores: Mapping[str, Any]) -> str:
    """Return the scores in a sentence."""
    return (
        f'Another goal: with the right one left out its share is {scores["share_left_out"]:.2f} on average, with it '
        f'{scores["share"]:.2f}; area under the curve {scores["area_under_curve_half_way"]:.2f} half way, '
        f'{scores["area_under_curve"]:.2f} of all; calibration error {scores["calibration_error"]:.3f}; '
        f'loss {scores["loss"]:.3f} nat.'
    )
