"""Trials of the recovery: an operator who plans with known (tau, lambda), seen by a sensor, and what is found of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.config import Config, FocConfig
from foc_ros.core.types import NANOSECONDS, Array, Obstacles, make_obstacles
from foc_ros.io.guess import guess_path

from .demonstrations import Demonstration
from .plans import planned, positions_at, reach
from .recovery import Recovered, recover

SENSOR_STDDEV_M, RATE_HZ, DURATION_S = 1e-3, 100.0, 1.0
GOALS = np.array([[0.3, -0.05], [0.3, 0.0], [0.3, 0.05]])
BOWS_M = (0.06, -0.06)
CONFIG = Config(foc=FocConfig(strategy='fixed', noise_x=0.1, noise_y=0.1))
TAU_RANGE_M2, LAMBDA_RANGE = (5e-4, 3e-3), (2e5, 1e7)


@dataclass(frozen=True)
class Trial:
    """One trial: what the operator planned with, how many movements were seen, and what was found."""

    tau: float
    lam: float
    movements: int
    found: Recovered

    @property
    def recovered(self) -> bool:
        """Whether tau was found within 5 % and lambda within a factor of 1.2."""
        factor = self.found.lam / self.lam
        return abs(self.found.tau / self.tau - 1.0) <= 0.05 and max(factor, 1.0 / factor) <= 1.2


def trial(seed: int, repeats: int = 2) -> Trial:
    """Draw (tau, lambda) and a scene, move, and recover."""
    draws = np.random.default_rng(seed)
    tau, lam = (float(np.exp(draws.uniform(*np.log(bounds)))) for bounds in (TAU_RANGE_M2, LAMBDA_RANGE))
    movements = demonstrations(tau, lam, draws, repeats)
    return Trial(tau, lam, len(movements), recover([reach(each, CONFIG) for each in movements], CONFIG))


def demonstrations(tau: float, lam: float, draws: np.random.Generator, repeats: int) -> list[Demonstration]:
    """Return reaches of 0.3 m in 1 s to three goals, left and right of two obstacles of 2 to 3 cm, each made `repeats` times.

    These are few minutes of an operator's time. Ways on which there is no plan with (tau, lambda) are left out.
    """
    centres = [[0.12, draws.uniform(-0.01, 0.01)], [0.2, draws.uniform(-0.05, 0.05)]]
    obstacles = make_obstacles(centres, draws.uniform(0.02, 0.03, 2), 0.003)
    made = []
    for goal in GOALS:
        for bow in BOWS_M:
            true = _true_positions(tau, lam, obstacles, goal, bow)
            if true is None:
                continue
            for repeat in range(repeats):
                seen = true + draws.normal(0.0, SENSOR_STDDEV_M, (len(TIMES_S), 2))
                made.append(Demonstration(f'{goal[1]:+g} {bow:+g} {repeat}', STAMPS_NS, seen, obstacles, GOALS))
    return made


TIMES_S: Array = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
STAMPS_NS = np.round(TIMES_S * NANOSECONDS).astype(np.int64)


def _true_positions(tau: float, lam: float, obstacles: Obstacles, goal: Array, bow: float) -> Array | None:
    guess = guess_path(np.zeros(2), goal, len(TIMES_S) - 1, bow)
    solution = planned(reach(Demonstration('guess', STAMPS_NS, guess, obstacles, goal[None]), CONFIG), tau, lam, CONFIG)
    return None if solution is None else positions_at(solution, TIMES_S)
