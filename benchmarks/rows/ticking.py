"""Predictions one after the other, as a node makes them, timed tick by tick."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from measure import Times
from scenes import Reach

from foc_ros.core.memory import Memory
from foc_ros.core.predictor import predict
from foc_ros.core.types import Prediction


class Ticking:
    """Goes through the ticks of a reach; after the last one the hand starts over, by a cold tick that is not timed."""

    def __init__(self, reach: Reach) -> None:
        self.reach, self.at, self.memory = reach, 0, Memory()
        self.predictions: list[Prediction] = []

    def prepare(self) -> None:
        """Make the cold tick where one is due."""
        self.at %= len(self.reach.hands)
        if self.at == 0:
            self.memory = self._predict(Memory())[1]
            self.at = 1

    def tick(self) -> float:
        """Make the next prediction and return its time [s]."""
        self.prepare()
        began = time.perf_counter()
        prediction, self.memory = self._predict(self.memory)
        seconds = time.perf_counter() - began
        self.at += 1
        self.predictions.append(prediction)
        return seconds

    def _predict(self, memory: Memory) -> tuple[Prediction, Memory]:
        reach = self.reach
        return predict(reach.config, reach.hands[self.at], reach.obstacles, reach.goals, memory)

    def far_from_cold(self) -> float:
        """Return how far the paths of the last prediction are from those of the same tick without memory [m].

        Only classes that both solved; infinite where one of them solved none that the other did.
        """
        last = self.predictions[-1]
        hand = next(hand for hand in self.reach.hands if hand.stamp_ns == last.stamp_ns)
        fresh, _ = predict(self.reach.config, hand, self.reach.obstacles, self.reach.goals, Memory())
        paths = {outcome.candidate.label: outcome.solution.path for outcome in fresh.solved_candidates}
        shared = [
            (each.solution.path, paths[each.candidate.label]) for each in last.solved_candidates if each.candidate.label in paths
        ]
        return max((float(np.abs(warm - cold).max()) for warm, cold in shared), default=np.inf)

    def classes(self) -> str:
        """Return how many classes were solved, of how many, in the middle one of the ticks."""
        solved = sorted((len(each.solved_candidates), len(each.candidates)) for each in self.predictions)
        return '{} of {}'.format(*solved[len(solved) // 2])


def alternating(tickings: Mapping[str, Ticking], repetitions: int) -> Times:
    """Return the times [s] of ticks made in turn."""
    times: Times = {name: [] for name in tickings}
    for _ in range(repetitions):
        for name, ticking in tickings.items():
            times[name].append(ticking.tick())
    return times
