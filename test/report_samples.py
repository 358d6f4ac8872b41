# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A scene, hand samples and predictions in closed form, so that a test knows the contents of a picture."""

from dataclasses import replace

import numpy as np
import prediction_samples

from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import LEFT, RIGHT, Candidate, Status
from foc_ros.core.types import NANOSECONDS, Array, HandSample

START_NS = 1_000 * NANOSECONDS
OBSTACLES = make_obstacles([[0.15, 0.0], [0.22, 0.1]], [0.03, 0.02], [0.003, 0.0], ids=('1', 'post'))
GOALS: Array = np.array([[0.3, 0.0], [0.3, 0.12]])


SIDES = {
    'goal0:+1': (('1', LEFT),),
    'goal0:-1': (('1', RIGHT),),
    'goal1:+1-post': (('1', LEFT), ('post', RIGHT)),
    'goal1:+1+post': (('1', LEFT), ('post', LEFT)),
}


def quintic(s: Array) -> Array:
    return s**3 * (10 - 15 * s + 6 * s**2)


def samples(reaches: int = 1, seconds: float = 1.0, rest: float = 0.5) -> list[HandSample]:
    """Return reaches to and fro along x, over the first obstacle, at 100 Hz."""
    made = []
    for step in range(round(100 * reaches * (seconds + rest))):
        number, phase = divmod(step / 100, seconds + rest)
        s = quintic(np.clip((phase - rest) / seconds, 0.0, 1.0))
        s = s if number % 2 == 0 else 1.0 - s
        position = np.array([0.3 * s, 0.05 * np.sin(np.pi * s)])
        made.append(HandSample(START_NS + step * 10_000_000, position, 0.1, 'world'))
    return made


def outcome(
    label: str, goal: int, bow: float, likelihood: float, start: Array, status: Status = Status.SOLVED
) -> PredictedCandidate:
    s, dt = np.linspace(0.0, 1.0, 21), 0.05
    path = start + quintic(s)[:, None] * (GOALS[goal] - start) + np.outer(np.sin(np.pi * s), [0.0, bow])
    covariance = np.zeros((21, 6, 6))
    covariance[:, 0, 0], covariance[:, 1, 1] = (0.001 + 0.01 * s) ** 2, (0.001 + 0.004 * s) ** 2
    solution = {
        'status': status,
        'message': 'solved' if status is Status.SOLVED else 'out of reach',
        'dt': dt,
        'mean': np.column_stack([path, np.gradient(path, dt, axis=0), np.zeros_like(path)]),
        'covariance': covariance,
        'control': np.zeros((20, 2)),
        'effort': 100.0 * (2 - likelihood),
        'eta': 0.9,
    }
    made = prediction_samples.outcome(label, likelihood, cost=100.0 * (2 - likelihood), **solution)
    return replace(made, candidate=Candidate(label, goal, SIDES[label], path, 0.3), sides={}, way=list(SIDES).index(label))


def prediction(stamp_ns: int, start: Array, share: float = 0.6) -> Prediction:
    outcomes = [
        outcome('goal0:+1', 0, 0.06, share, start),
        outcome('goal0:-1', 0, -0.06, 0.9 - share, start),
        outcome('goal1:+1-post', 1, 0.02, 0.1, start),
    ]
    outcomes.sort(key=lambda each: -each.likelihood)
    lost = outcome('goal1:+1+post', 1, 0.1, 0.0, start, Status.ETA_UNREACHABLE)
    return Prediction(
        stamp_ns, 'world', 0.1, (*outcomes, lost), outcomes[0].candidate.label, {}, 0.004, OBSTACLES, GOALS, (), 0.25
    )


def predictions(of: list[HandSample], every: int = 4) -> list[Prediction]:
    chosen = of[::every]
    return [prediction(sample.stamp_ns, sample.position, 0.3 + 0.5 * row / len(chosen)) for row, sample in enumerate(chosen)]


def scene() -> tuple[Obstacles, Array]:
    return OBSTACLES, GOALS


def widen(made: Prediction) -> Prediction:
    """Return a prediction whose total uncertainty is greater than its motor noise, as that of the predictor."""
    wide = [each.solution.with_covariance(3.0 * each.solution.covariance) for each in made.candidates]
    pairs = zip(made.candidates, wide, strict=True)
    return replace(made, candidates=tuple(replace(each, solution=solution) for each, solution in pairs))
