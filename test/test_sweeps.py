# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Answers over a parameter: without jumps of effort and likelihood, and eta met beside a box however near it is."""

from collections.abc import Callable

import numpy as np
import pytest

import foc_ros
from foc_ros.core.config import Config
from foc_ros.core.obstacles.shapes import collect_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

FAST = Config().with_values({'foc.steps': 25, 'duration.model': 'fixed', 'foc.noise_x': 0.1, 'foc.noise_y': 0.1})
GOALS = np.array([[0.3, 0.0]])
LARGEST, BISECTIONS = 0.03, 6
LEAST_LIKELIHOOD = 0.01
Answers = dict[str, tuple[float, float]]


def answer(shapes, values, state=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0)) -> Answers:
    """Return ln J and likelihood by class, for a prediction without a past."""
    hand = HandState(0, np.array(state), np.zeros((6, 6)), onset_ns=0, onset_position=np.zeros(2))
    prediction, _ = predict(FAST.with_values(values), hand, collect_obstacles(shapes), GOALS, NO_TRACKS)
    for each in prediction.candidates:
        is_unlikely = each.status.value in ('estimated', 'infeasible') and each.likelihood < 0.05
        assert is_unlikely or each.status.value in ('solved', 'compromised'), (each.label, each.solution.message, values, state)
    return {each.label: (float(np.log(each.solution.effort)), each.likelihood) for each in prediction.candidates}


SCENES = {
    'box': lambda y: [foc_ros.Box((0.15, y), size=(0.06, 0.04), yaw=0.3, radius=0.005, radius_stddev=0.001)],
    'gap': lambda y: [
        foc_ros.Box((0.15, y + 0.045), size=(0.03, 0.05)),
        foc_ros.Capsule((0.15, -0.05), (0.18, -0.08), 0.015, 0.001, centre_stddev=0.001),
    ],
}
SWEEPS: dict[str, tuple[float, float, Callable[..., Answers]]] = {
    'eta': (0.5, 0.97, lambda make, eta: answer(make(0.0), {'foc.eta': eta})),
    'start': (-0.02, 0.02, lambda make, y: answer(make(0.0), {}, (0.0, y, 0.1, 0.0, 0.0, 0.0))),
}


def measure_jump(one: Answers, other: Answers) -> float:
    """Return the largest difference of a likelihood, or of the effort of a class that is not unlikely."""
    none, jumps = (0.0, 0.0), []
    for label in one.keys() | other.keys():
        (effort, share), (beside, later) = one.get(label, none), other.get(label, none)
        jumps += [abs(share - later), abs(effort - beside) if min(share, later) > LEAST_LIKELIHOOD else 0.0]
    return max(jumps)


SETTLED = [('box', 'eta'), ('gap', 'start')]
"""The other sweeps take long, or have points at which a class does not settle, or in another minimum."""


@pytest.mark.parametrize(('scene', 'sweep'), SETTLED)
def test_effort_and_likelihood_have_no_jumps(scene, sweep):
    """Of 40 points, no two neighbours differ by more than 3 %, unless bisection shrinks the difference."""
    low, high, find = SWEEPS[sweep]
    values = np.linspace(low, high, 40).tolist()
    answers, jumps = [find(SCENES[scene], value) for value in values], []
    for i in range(len(values) - 1):
        (left, one), (right, other) = (values[i], answers[i]), (values[i + 1], answers[i + 1])
        for _ in range(BISECTIONS):
            if measure_jump(one, other) < LARGEST:
                break
            middle = 0.5 * (left + right)
            between = find(SCENES[scene], middle)
            if measure_jump(one, between) > measure_jump(between, other):
                right, other = middle, between
            else:
                left, one = middle, between
        if measure_jump(one, other) >= LARGEST:
            jumps.append((left, right, one, other))
    assert jumps == []


@pytest.mark.parametrize('yaw', [0.0, 0.3])
@pytest.mark.parametrize('radius', [0.0, 0.005], ids=['sharp', 'rounded'])
@pytest.mark.parametrize('gap_mm', [1, 5, 30])
def test_beside_a_box_before_a_hand_at_rest_eta_is_met(gap_mm, radius, yaw):
    """However near it is, with all defaults."""
    centre = ((0.02 + radius + gap_mm / 1000) / np.cos(yaw), 0.0)
    solution = foc_ros.solve((0, 0), (0.3, 0), [foc_ros.Box(centre, size=(0.04, 0.06), radius=radius, yaw=yaw)])
    assert solution.status is foc_ros.Status.SOLVED
    assert solution.eta >= 0.9 - 1e-6
