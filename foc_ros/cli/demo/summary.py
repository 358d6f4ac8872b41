"""What a demo has shown, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.learning.movements import AT_GOAL_M, find_goal_at_end
from foc_ros.core.types import NANOSECONDS
from foc_ros.reporting.views import HandTrajectory, Snapshot, parse_label

ONSET_SPEED = 0.05
"""Speed [m/s] above which the hand counts as moving."""


def describe_lead(hand: HandTrajectory, snapshots: Sequence[Snapshot]) -> str:
    """Return how long before the end of the movements the goals that were reached had become the most likely ones."""
    leads = []
    for start_ns, end_ns in hand.find_movements(ONSET_SPEED):
        inside = [each for each in snapshots if start_ns <= each.stamp_ns <= end_ns and each.most_likely is not None]
        if not inside:
            continue
        goal, distance = find_goal_at_end(hand.positions[hand.between(start_ns, end_ns)], inside[-1].goals)
        if distance <= AT_GOAL_M:
            leads.append((_find_lead_s(inside, f'goal{goal}', end_ns), (end_ns - start_ns) / NANOSECONDS))
    if not leads:
        return f'{len(snapshots)} predictions were made; no movement ended at a goal.'
    median, duration_s = np.median(leads, axis=0).tolist()
    return (
        f'{len(snapshots)} predictions were made. The hand moved to a goal {len(leads)} times, for {duration_s:.1f} s; this goal '
        f'was the most likely one from {median:.1f} s before the arrival on (medians).'
    )


def _find_lead_s(snapshots: Sequence[Snapshot], goal: str, end_ns: int) -> float:
    """Return the time [s] before the end from which on the most likely candidate leads to a goal; 0 if it does not at last."""
    lead_ns = 0
    for each in reversed(snapshots):
        if parse_label(str(each.most_likely), ())[0] != goal:
            break
        lead_ns = end_ns - each.stamp_ns
    return lead_ns / NANOSECONDS
