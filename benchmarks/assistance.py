# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `simulate` of foc_ros, which here knows the assistance rules of others, too; it prints the same cells.

python benchmarks/assistance.py [--operators A,B] [--assistance A,B] [--trials N] [--seed S] [--params YAML] [--json]

The rules are from their papers: hindsight optimization, blending by confidence, and the potential field. All have the same
estimate of the hand and the same limits of force and slew as the guidance of this package.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np

from foc_ros.analysis.simulation.operators import Task
from foc_ros.analysis.simulation.study import RULES, Assistance
from foc_ros.cli import studies
from foc_ros.cli.main import main
from foc_ros.cli.options import PLAIN, Existing, Operators, Seed, Study, Trials, app, names
from foc_ros.core.config import Config
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array

RATIONALITY = 50.0
"""Log-likelihood of a goal that an operator loses with each metre of detour [1/m]."""
ASSISTANCE_N = 1.5
"""Force with which a rule draws to a goal [N]."""
SLOWS_WITHIN_M = 0.05
"""Distance from a goal within which that force falls linearly."""
CONFIDENCE = (0.2, 0.6)
"""Confidence p1 - p2 at which blending begins, and from which on it is complete."""
INFLUENCE_M = 0.03
"""Distance from an obstacle at which its potential field begins."""
FULL_FORCE_M = 0.005
"""Distance from an obstacle at which its potential field has the force `ASSISTANCE_N`."""


class GoalInference:
    """Likelihood of goals from the path so far (Dragan and Srinivasa 2013, doi 10.1177/0278364913490324, section 4.2).

    With the path from S to U of the length C, and the cost-to-go V_g, which is here the distance to the goal,

        p(g) ~ exp(-r (C + V_g(U) - V_g(S))).
    """

    def __init__(self, goals: Array, start: Array) -> None:
        self._goals, self._start, self._last, self._length = goals, start, start, 0.0

    def update(self, position: Array) -> Array:
        """Return the probabilities (g,) of the goals after the hand has moved to a position (2,) [m]."""
        self._length += float(np.hypot(*(position - self._last)))
        self._last = position
        distances = [np.hypot(*(self._goals - each).T) for each in (position, self._start)]
        costs = RATIONALITY * (self._length + distances[0] - distances[1])
        weights = np.exp(costs.min() - costs)
        probabilities: Array = weights / weights.sum()
        return probabilities


def draw_to_goals(position: Array, goals: Array) -> Array:
    """Return the policies (g, 2) [N]: the force that draws a hand straight to each goal."""
    offsets = goals - position
    distances = np.hypot(offsets[:, 0], offsets[:, 1])[:, None]
    policies: Array = ASSISTANCE_N * offsets / np.maximum(distances, SLOWS_WITHIN_M)
    return policies


def compute_hindsight_force(position: Array, goals: Array, probabilities: Array) -> Array:
    """Return sum_g p_g pi_g(x) (2,) [N], with the policy pi_g to each goal.

    Hindsight optimization minimises the expected cost-to-go as if the goal were known after the next step. With costs that are
    quadratic in the action, that is the mean of the policies (Javdani et al. 2015, arXiv 1503.07619; 2018, doi
    10.1177/0278364918776060).
    """
    force: Array = probabilities @ draw_to_goals(position, goals)
    return force


def compute_blending_force(position: Array, goals: Array, probabilities: Array) -> Array:
    """Return a pi_g(x) (2,) [N] for the likeliest goal g, with the arbitration a.

        a = clip((p1 - p2 - c_lo) / (c_hi - c_lo), 0, 1)

    The confidence is the lead of the likeliest goal over the second one; the arbitration grows linearly from a threshold on, up
    to a limit (Dragan and Srinivasa 2013, section 5).
    """
    ordered = np.sort(probabilities)[::-1]
    lead = ordered[0] - (ordered[1] if len(ordered) > 1 else 0.0)
    arbitration = np.clip((lead - CONFIDENCE[0]) / (CONFIDENCE[1] - CONFIDENCE[0]), 0.0, 1.0)
    force: Array = arbitration * draw_to_goals(position, goals)[probabilities.argmax()]
    return force


def compute_field_force(position: Array, obstacles: Obstacles, strongest: float) -> Array:
    """Return the force (2,) [N] of the artificial potential field (Khatib 1986, doi 10.1177/027836498600500106, equation 18).

        f = sum_j eta (1 / rho_j - 1 / rho_0) / rho_j^2 grad(rho_j)    where rho_j <= rho_0,

    with the distance rho_j from obstacle j. eta follows from `FULL_FORCE_M`. The force of each obstacle is at most `strongest`
    [N].
    """
    if not len(obstacles):
        return np.zeros(2)
    offsets, distances = measure_offsets(position, obstacles)
    sides = np.where(distances[0] == 0.0, 1.0, distances[0])
    gradients, rho = offsets[0] / sides[:, None], np.maximum(distances[0] - obstacles.radius, 1e-4)
    eta = ASSISTANCE_N * FULL_FORCE_M**2 / (1.0 / FULL_FORCE_M - 1.0 / INFLUENCE_M)
    sizes = np.where(rho <= INFLUENCE_M, eta * (1.0 / rho - 1.0 / INFLUENCE_M) / rho**2, 0.0)
    force: Array = np.minimum(sizes, strongest) @ gradients
    return force


class _GoalAssistance(Assistance):
    """A rule that knows goals only: a function of position, goals and their probabilities."""

    rule: ClassVar[staticmethod[[Array, Array, Array], Array]]

    def __init__(self, task: Task, config: Config) -> None:
        super().__init__(task, config)
        self._inference = GoalInference(task.goals, task.path[0, 0])

    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:  # noqa: ARG002
        """Return the force of the rule for the present probabilities of the goals."""
        probabilities = self._inference.update(position)
        self.is_wrong = int(probabilities.argmax()) != self.task.goal_row
        return self.rule(position, self.task.goals, probabilities)


class Hindsight(_GoalAssistance):
    """Hindsight optimization."""

    rule = staticmethod(compute_hindsight_force)


class Blend(_GoalAssistance):
    """Blending by confidence."""

    rule = staticmethod(compute_blending_force)


class PotentialField(Assistance):
    """The potential field of the obstacles."""

    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:  # noqa: ARG002
        """Return the force of the field."""
        grown = self.task.obstacles.grow(self.task.hand_radius)
        return compute_field_force(position, grown, self.config.guidance.f_max)


RIVALS: Mapping[str, type[Assistance]] = {'hindsight': Hindsight, 'blend': Blend, 'potential_field': PotentialField}
"""The rules of others by name."""
ALL = ('none', 'foc', *RIVALS)


def simulate(
    *,
    operators: Operators | None = None,
    assistance: Annotated[tuple[str, ...], names(ALL)] = ALL,
    trials: Trials = 20,
    seed: Seed = 0,
    recordings: Existing | None = None,
    study: Study = PLAIN,
) -> int:
    """Compare guidance with the assistance rules of others; the options are those of `foc_ros simulate`."""
    RULES.update(RIVALS)
    return studies.simulate(
        operators=operators, assistance=assistance, trials=trials, seed=seed, recordings=recordings, study=study
    )


if __name__ == '__main__':
    del app['simulate']
    app.command(simulate)
    sys.exit(main(['simulate', *sys.argv[1:]]))
