"""The figures of doc/calibration.md on the recovery of tau and lambda: 20 trials, as a table in Markdown.

In each trial an operator plans with known (tau, lambda), a sensor with noise measures the movements, and the fit recovers both.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from foc_ros.analysis.fitting.plan_fit import Recovered, interpolate_plan, make_reach, plan, recover_tau_and_lambda
from foc_ros.analysis.fitting.recorded_hand import RecordedHand
from foc_ros.core.config import Config, FocConfig
from foc_ros.core.types import NANOSECONDS, Array, Obstacles, make_obstacles
from foc_ros.io.scene_file import guess_path

TRIALS = 20
SENSOR_STDDEV_M, RATE_HZ, DURATION_S = 1e-3, 100.0, 1.0
GOALS = np.array([[0.3, -0.05], [0.3, 0.0], [0.3, 0.05]])
BOWS_M = (0.06, -0.06)
CONFIG = Config(foc=FocConfig(strategy='fixed', noise_x=0.1, noise_y=0.1))
TAU_RANGE_M2, LAMBDA_RANGE = (5e-4, 3e-3), (2e5, 1e7)
TIMES_S: Array = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
STAMPS_NS = np.round(TIMES_S * NANOSECONDS).astype(np.int64)


@dataclass(frozen=True)
class Trial:
    """One trial: the true tau and lambda, the number of movements, and the estimate."""

    tau: float
    lam: float
    movements: int
    found: Recovered

    @property
    def is_recovered(self) -> bool:
        """Whether tau was found within 5 % and lambda within a factor of 1.2."""
        factor = self.found.lam / self.lam
        return abs(self.found.tau / self.tau - 1.0) <= 0.05 and max(factor, 1.0 / factor) <= 1.2


def run_trial(seed: int, repeats: int = 2) -> Trial:
    """Draw (tau, lambda) and a scene, simulate movements, and recover (tau, lambda)."""
    draws = np.random.default_rng(seed)
    tau, lam = (float(np.exp(draws.uniform(*np.log(bounds)))) for bounds in (TAU_RANGE_M2, LAMBDA_RANGE))
    hands = simulate_hands(tau, lam, draws, repeats)
    return Trial(tau, lam, len(hands), recover_tau_and_lambda([make_reach(each, CONFIG) for each in hands], CONFIG))


def simulate_hands(tau: float, lam: float, draws: np.random.Generator, repeats: int) -> list[RecordedHand]:
    """Return reaches of 0.3 m in 1 s to three goals, left and right of two obstacles of 2 to 3 cm, each made `repeats` times.

    These are few minutes of an operator's time. Homotopy classes without a plan with (tau, lambda) are left out.
    """
    centres = [[0.12, draws.uniform(-0.01, 0.01)], [0.2, draws.uniform(-0.05, 0.05)]]
    obstacles = make_obstacles(centres, draws.uniform(0.02, 0.03, 2), 0.003)
    hands = []
    for goal in GOALS:
        for bow in BOWS_M:
            true = _plan_positions(tau, lam, obstacles, goal, bow)
            if true is None:
                continue
            for repeat in range(repeats):
                measured = true + draws.normal(0.0, SENSOR_STDDEV_M, (len(TIMES_S), 2))
                hands.append(RecordedHand(f'{goal[1]:+g} {bow:+g} {repeat}', STAMPS_NS, measured, obstacles, GOALS))
    return hands


def _plan_positions(tau: float, lam: float, obstacles: Obstacles, goal: Array, bow: float) -> Array | None:
    guess = guess_path(np.zeros(2), goal, len(TIMES_S) - 1, bow)
    solution = plan(make_reach(RecordedHand('guess', STAMPS_NS, guess, obstacles, goal[None]), CONFIG), tau, lam, CONFIG)
    return None if solution is None else interpolate_plan(solution, TIMES_S)


def main() -> int:
    """Run the trials and print them."""
    trials = [run_trial(seed) for seed in range(TRIALS)]
    print('| tau [m^2] | lambda | movements | tau found / true | lambda found / true | recovered |\n|---|---|---|---|---|---|')
    for each in trials:
        ratios = f'{each.found.tau / each.tau:.3f} | {each.found.lam / each.lam:.3f}'
        print(f'| {each.tau:.2e} | {each.lam:.2e} | {each.movements} | {ratios} | {"yes" if each.is_recovered else "no"} |')
    print(f'\n{sum(each.is_recovered for each in trials)} of {TRIALS} recovered')
    return 0


if __name__ == '__main__':
    sys.exit(main())
