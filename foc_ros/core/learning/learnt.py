# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""All that is learnt while the hand moves, as one record that follows the samples of the hand and the predictions.

Each part learns only where its parameter says `online`: the pace (`duration.adaptation`), the errors (`covariance.adaptation`)
and the recordings of the scene (`experience.learning`); habits where `likelihood.past_goals` is not zero. All depend on samples,
scene and predictions alone, so that equal input gives equal results.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

from foc_ros.core.config import ONLINE, Config, CovarianceConfig
from foc_ros.core.likelihood import BETWEEN_OPERATORS, OWN_SPREAD
from foc_ros.core.prediction import Prediction
from foc_ros.core.scene import Scene
from foc_ros.core.types import HandState

from .dispersion import Dispersion
from .habits import Habits
from .movements import Movements
from .pace import Pace
from .recordings import NO_LIBRARY, Library


class Knowledge(NamedTuple):
    """What a prediction is made with besides parameters and scene.

    library: recorded paths; planning_spread: standard deviation of the logarithm of the operator's planning horizon; objects: for
    each goal the id of the obstacle that it is, None, or no entry, where none is named; habits: goals of the past.
    """

    library: Library = NO_LIBRARY
    planning_spread: float = BETWEEN_OPERATORS
    objects: tuple[str | None, ...] = ()
    habits: Habits = Habits()


NOTHING = Knowledge()


@dataclass(frozen=True)
class Learnt:
    """What was learnt of the operator (pace, dispersion, habits) and of the scene (movements)."""

    pace: Pace = field(default_factory=Pace)
    dispersion: Dispersion = field(default_factory=Dispersion)
    movements: Movements = field(default_factory=Movements)
    habits: Habits = field(default_factory=Habits)

    def adapt(self, config: Config) -> Config:
        """Return the parameters with which the next prediction is made: those given, adapted to the operator."""
        duration, covariance = self.pace.adapt(config.duration), self.dispersion.adapt(config.covariance)
        is_same = duration is config.duration and covariance is config.covariance
        return config if is_same else replace(config, duration=duration, covariance=covariance)

    @property
    def planning_spread(self) -> float:
        """Standard deviation of the logarithm of the planning horizon: between operators, or of one whose pace is known."""
        return OWN_SPREAD if self.pace.movements else BETWEEN_OPERATORS

    def follow(self, hand: HandState, scene: Scene, config: Config, *, is_restart: bool) -> Learnt:
        """Return what is known after the next state of the hand.

        config: before it is adapted; is_restart: whether the filter of the hand began anew.
        """
        pace, dispersion, movements, habits = self.pace, self.dispersion, self.movements, self.habits
        if config.duration.adaptation == ONLINE:
            pace = pace.follow(hand, scene.goals, config.duration)
        if config.covariance.adaptation == ONLINE:
            dispersion = dispersion.follow(hand)
        if config.experience.learning != 'none':
            movements = movements.follow(hand, scene, is_restart=is_restart)
        if config.likelihood.past_goals > 0.0:
            habits = habits.follow(hand, scene, config.likelihood.beta)
        return Learnt(pace, dispersion, movements, habits)

    def add(self, prediction: Prediction, config: CovarianceConfig) -> Learnt:
        """Return what is known after a prediction with the factors of config."""
        return replace(self, dispersion=self.dispersion.add(prediction.stamp_ns, prediction.candidates, config))

    def interrupt(self) -> Learnt:
        """Return what is known where the samples of the hand stop: the present movement ends there."""
        pace, dispersion = self.pace.interrupt(), self.dispersion.interrupt()
        return Learnt(pace, dispersion, self.movements.interrupt(), self.habits.interrupt())

    def reconfigure(self, before: Config, now: Config) -> Learnt:
        """Return what still holds with other parameters: what depends on one that changed is forgotten."""
        dispersed_by = ('foc', 'duration', 'covariance', 'estimator')  # errors and covariances depend on these
        is_dispersed = any(getattr(before, name) != getattr(now, name) for name in dispersed_by)
        is_recorded = (before.experience.learning, before.estimator) == (now.experience.learning, now.estimator)
        return Learnt(
            self.pace if before.duration == now.duration else Pace(),
            Dispersion() if is_dispersed else self.dispersion,
            self.movements if is_recorded else Movements(),
            self.habits if before.likelihood.beta == now.likelihood.beta else Habits(),
        )
