"""Predictions in sequence, as the node makes them, timed tick by tick."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from measurement import Times
from scenes import Reach

from foc_ros.core.memory.memory import Memory
from foc_ros.core.predictor import predict
from foc_ros.core.types import Prediction


class TickSequence:
    """The ticks of a reach, repeated without end. The first tick of each repetition is cold and is not timed."""

    def __init__(self, reach: Reach) -> None:
        self.reach, self.index, self.memory = reach, 0, Memory()
        self.predictions: list[Prediction] = []

    def prepare(self) -> None:
        """Make the cold tick if it is the next one."""
        self.index %= len(self.reach.hands)
        if self.index == 0:
            self.memory = self._predict(Memory())[1]
            self.index = 1

    def tick(self) -> float:
        """Make the next prediction and return its time [s]."""
        self.prepare()
        began = time.perf_counter()
        prediction, self.memory = self._predict(self.memory)
        seconds = time.perf_counter() - began
        self.index += 1
        self.predictions.append(prediction)
        return seconds

    def _predict(self, memory: Memory) -> tuple[Prediction, Memory]:
        reach = self.reach
        return predict(reach.config, reach.hands[self.index], reach.obstacles, reach.goals, memory)

    def compute_distance_to_cold(self) -> float:
        """Return the largest distance between the paths of the last prediction and of the same tick without memory [m].

        Classes that both ticks solved are compared; without such a class, the distance is infinite.
        """
        last = self.predictions[-1]
        hand = next(hand for hand in self.reach.hands if hand.stamp_ns == last.stamp_ns)
        fresh, _ = predict(self.reach.config, hand, self.reach.obstacles, self.reach.goals, Memory())
        paths = {each.candidate.label: each.solution.path for each in fresh.solved_candidates}
        distances = [
            float(np.abs(each.solution.path - paths[each.candidate.label]).max())
            for each in last.solved_candidates
            if each.candidate.label in paths
        ]
        return max(distances, default=np.inf)

    def describe_classes(self) -> str:
        """Return how many classes were solved, and of how many; the median over the ticks."""
        counts = sorted((len(each.solved_candidates), len(each.candidates)) for each in self.predictions)
        return '{} of {}'.format(*counts[len(counts) // 2])


def time_ticks_in_turn(sequences: Mapping[str, TickSequence], repetitions: int) -> Times:
    """Return the times of ticks that the sequences make in turn."""
    times: Times = {name: [] for name in sequences}
    for _ in range(repetitions):
        for name, sequence in sequences.items():
            times[name].append(sequence.tick())
    return times
