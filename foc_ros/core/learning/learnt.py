"""All that is learnt while the hand moves, as one record that follows the samples of the hand and the predictions.

Each part learns only where its parameter says `online`: the pace (`duration.adaptation`), the choices (`likelihood.adaptation`),
the errors (`covariance.adaptation`) and the recordings of the scene (`experience.learning`). All depend on samples, scene and
predictions alone, so that equal input gives equal results.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from foc_ros.core.config import ONLINE, Config, CovarianceConfig
from foc_ros.core.obstacles.scene import Scene
from foc_ros.core.types import HandState, Prediction

from .choices import Choice, Preferences
from .dispersion import Dispersion
from .movements import Movements
from .pace import Pace

DISPERSED_BY = ('foc', 'duration', 'covariance', 'estimator')
"""Groups of parameters on which errors and covariances depend."""


@dataclass(frozen=True)
class Learnt:
    """What was learnt of the operator (pace, preferences, dispersion) and of the scene (movements)."""

    pace: Pace = field(default_factory=Pace)
    preferences: Preferences = field(default_factory=Preferences)
    dispersion: Dispersion = field(default_factory=Dispersion)
    movements: Movements = field(default_factory=Movements)

    def adapt(self, config: Config) -> Config:
        """Return the parameters with which the next prediction is made: those given, adapted to the operator."""
        duration, likelihood = self.pace.adapt(config.duration), self.preferences.adapt(config.likelihood)
        covariance = self.dispersion.adapt(config.covariance)
        is_same = duration is config.duration and likelihood is config.likelihood and covariance is config.covariance
        return config if is_same else replace(config, duration=duration, likelihood=likelihood, covariance=covariance)

    def follow(self, hand: HandState, scene: Scene, config: Config, *, is_restart: bool) -> Learnt:
        """Return what is known after the next state of the hand.

        config: before it is adapted; is_restart: whether the filter of the hand began anew.
        """
        pace, preferences, dispersion, movements = self.pace, self.preferences, self.dispersion, self.movements
        if config.duration.adaptation == ONLINE:
            pace = pace.follow(hand, scene.goals, config.duration)
        if config.likelihood.adaptation == ONLINE:
            preferences = preferences.follow(hand, config.likelihood)
        if config.covariance.adaptation == ONLINE:
            dispersion = dispersion.follow(hand)
        if config.experience.learning == ONLINE:
            movements = movements.follow(hand, scene, is_restart=is_restart)
        return Learnt(pace, preferences, dispersion, movements)

    def add(self, prediction: Prediction, choice: Choice | None, config: CovarianceConfig) -> Learnt:
        """Return what is known after a prediction with its choice and with the factors of config."""
        dispersion = self.dispersion.add(prediction.stamp_ns, prediction.candidates, config)
        return replace(self, preferences=self.preferences.add(choice), dispersion=dispersion)

    def interrupt(self) -> Learnt:
        """Return what is known where the samples of the hand stop: the present movement ends there."""
        preferences, dispersion = self.preferences.interrupt(), self.dispersion.interrupt()
        return Learnt(self.pace.interrupt(), preferences, dispersion, self.movements.interrupt())

    def reconfigure(self, before: Config, now: Config) -> Learnt:
        """Return what still holds with other parameters: what depends on one that changed is forgotten."""
        is_dispersed = any(getattr(before, name) != getattr(now, name) for name in DISPERSED_BY)
        is_recorded = (before.experience.learning, before.estimator) == (now.experience.learning, now.estimator)
        return Learnt(
            self.pace if before.duration == now.duration else Pace(),
            self.preferences if before.likelihood == now.likelihood else Preferences(),
            Dispersion() if is_dispersed else self.dispersion,
            self.movements if is_recorded else Movements(),
        )
