"""Observations and recordings made by hand, for the tests of the evaluation."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from foc_ros.analysis.evaluation.observations import TIMES_S, Observation, Observations, Truth, Ways
from foc_ros.core.homotopy.branch_times import BranchTimes
from foc_ros.core.types import LEFT, RIGHT

H = len(TIMES_S)


def ways(sides, goal=None, likelihood=None, to_go=None, solved=None, price=0.0) -> Ways:
    """Candidates that pass obstacles on sides (k, n); each its own way, all parting now."""
    k, n = np.shape(sides)
    solved = np.ones(k, dtype=bool) if solved is None else np.array(solved)
    even = np.where(solved, 1.0 / solved.sum(), 0.0)
    return Ways(
        labels=tuple(f'way{i}' for i in range(k)),
        goal=np.zeros(k, dtype=int) if goal is None else np.array(goal),
        solved=solved,
        spent=0.0,
        to_go=np.ones(k) if to_go is None else np.array(to_go, dtype=float),
        likelihood=even if likelihood is None else np.array(likelihood, dtype=float),
        length=np.arange(1.0, k + 1.0),
        price=price,
        time_s=np.ones(k),
        named=np.ones((k, n), dtype=bool),
        sides=np.array(sides, dtype=np.int8).reshape(k, n),
        mean=np.zeros((k, H, 2)),
        covariance=np.tile(np.eye(2), (k, H, 1, 1)),
        late=np.zeros((k, H, 2)),
        partings=BranchTimes(np.where(np.eye(k, dtype=bool), np.inf, 0.0), np.arange(k)),
    )


def observation(
    candidates: Ways,
    centre=((1.0, 0.0),),
    row=(0,),
    true_sides=(LEFT,),
    ahead=None,
    goals=((2.0, 0.0),),
    goal=0,
    hand=(0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
    since_s=1.0,
    progress=0.0,
    approach=0.0,
    positions=None,
) -> Observation:
    """A hand on its way along x among obstacles."""
    centre = np.array(centre, dtype=float).reshape(-1, 2)
    truth = Truth(
        sides=np.array(true_sides, dtype=np.int8),
        ahead=np.ones(len(centre), dtype=bool) if ahead is None else np.array(ahead),
        goal=goal,
        positions=np.zeros((H, 2)) if positions is None else np.array(positions, dtype=float),
        progress=progress,
        approach=approach,
    )
    return Observation(
        stamp_ns=0,
        hand=np.array(hand, dtype=float),
        since_s=since_s,
        ids=tuple(str(i) for i in range(len(centre))),
        centre=centre,
        row=np.array(row, dtype=int),
        along=np.array([1.0, 0.0]),
        goals=np.array(goals, dtype=float),
        ways=candidates,
        most_likely=candidates.labels[0],
        truth=truth,
    )


def recorded(*each: Observation, name: str = 'one') -> Observations:
    return Observations(name, each, {})


TWO_WAYS = ways([[LEFT], [RIGHT]])

PARAMETERS = '/**: {ros__parameters: {rate_hz: 4.0, foc.steps: 20, foc.strategy: fixed, foc.tau: 1.0e-4, foc.lam: 0.0}}'


def reach(aside: float, end: tuple[float, float], seconds: float = 1.0, rest: float = 0.2, rate: float = 40.0):
    """Times and positions of a minimum-jerk reach from the origin, bent aside by so much half way, resting before and after."""
    t = np.arange(0.0, seconds + 2.0 * rest, 1.0 / rate)
    s = np.clip((t - rest) / seconds, 0.0, 1.0)
    share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    x, y = share * end[0], share * end[1] + aside * np.sin(np.pi * share) ** 2
    return t, np.column_stack([x, y])


def write_tables(folder: Path, reaches, goals, obstacles=None) -> Path:
    """Write recordings (name: (times, positions)), goals and obstacles (x, y, radius) as CSV tables."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['recording,t_s,x_m,y_m']
    for name, (t, positions) in reaches.items():
        lines += [f'{name},{when:.4f},{x:.6f},{y:.6f}' for when, (x, y) in zip(t, positions, strict=True)]
    (folder / 'recordings.csv').write_text('\n'.join(lines) + '\n')
    (folder / 'goals.csv').write_text('x_m,y_m\n' + ''.join(f'{x},{y}\n' for x, y in goals))
    if obstacles is not None:
        (folder / 'obstacles.csv').write_text('x_m,y_m,radius_m\n' + ''.join(f'{x},{y},{r}\n' for x, y, r in obstacles))
    (folder / 'parameters.yaml').write_text(PARAMETERS)
    return folder
