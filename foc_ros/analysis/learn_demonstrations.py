"""Demonstrations in recordings: a movement that ends at a goal becomes an entry of the class library."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.errors import RecordingError
from foc_ros.core.homotopy.demonstrations import (
    MOST_STATES,
    STEP_S,
    Demonstration,
    is_same_demonstration,
    record_demonstration,
)
from foc_ros.core.obstacles.scene import Scene
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import Array

from .fitting.recorded_hand import read_hand
from .goal_reached import AT_GOAL_M, find_goal_at_end, find_reached_goal
from .recordings import Recording
from .replay import Step

SHORTEST_M = 0.05
"""Shorter movements demonstrate nothing [m]."""
AROUND_S = 1.0
"""Time before the onset and after the goal that a recording keeps [s]: predictions near both look as far."""


def learn_recording(recording: Recording, config: Config) -> Demonstration:
    """Return the movement of a recording, from its onset to where it is nearest to its goal, with the goal as its last point.

    The states begin up to AROUND_S before the onset and end up to AROUND_S after that place. Raises RecordingError where the
    recording cannot be read, contains no movement of at least SHORTEST_M that ends within AT_GOAL_M of a goal, or takes longer
    than MOST_STATES allow.
    """
    hand = read_hand(recording, config)
    last = find_reached_goal(hand.positions, hand.goals)[1]
    states = hand.estimate_states(config)
    onset = next((row for row, each in enumerate(states[: last + 1]) if each.onset_ns is not None), len(states))
    moving = states[onset : last + 1]
    if len(moving) < 2:
        raise RecordingError(
            f'{recording.name}: no movement: the hand was never faster than {config.estimator.onset_speed:g} m/s'
        )
    path = np.array([each.mean[:2] for each in moving])
    goal, distance_m = find_goal_at_end(path, hand.goals)
    length_m = float(np.hypot(*np.diff(path, axis=0).T).sum())
    if length_m < SHORTEST_M or distance_m > AT_GOAL_M:
        wanted = f'expected a movement of at least {SHORTEST_M:g} m that ends within {AT_GOAL_M:g} m of a goal'
        raise RecordingError(f'{recording.name}: {wanted}, got {length_m:.3g} m that end {distance_m:.3g} m from the nearest')
    first_s, last_s = max(hand.times[onset] - AROUND_S, 0.0), min(hand.times[last] + AROUND_S, hand.times[-1])
    if last_s - first_s > STEP_S * (MOST_STATES - 1):
        longest_s = STEP_S * (MOST_STATES - 1) - 2.0 * AROUND_S
        raise RecordingError(
            f'{recording.name}: expected a movement of at most {longest_s:g} s, got {hand.times[last] - hand.times[onset]:.3g} s'
        )
    at = np.arange(first_s, last_s, STEP_S)
    means = np.array([each.mean[:4] for each in states])
    kept = np.column_stack([np.interp(at, hand.times, axis) for axis in means.T])
    return record_demonstration(hand.frame_id, np.vstack([path, hand.goals[goal]]), hand.obstacles, kept)


class Learner:
    """Takes the steps of a replay.

    Attributes: ways, all demonstrations, those known before and those learned; learned, the number of new ones.
    """

    def __init__(self, pipeline: Pipeline, known: Sequence[Demonstration]) -> None:
        self.demonstrations = list(known)
        self.learned = 0
        self._pipeline = pipeline
        self._path: list[Array] = []
        self._onset_ns: int | None = None
        self._scene = Scene()
        self._stamp_ns = 0

    def add(self, step: Step) -> None:
        """Append the hand's position to the movement, or begin a new movement."""
        state = self._pipeline.hand_state
        if step.sample is None or state is None:
            return
        if state.onset_ns != self._onset_ns:
            self.finish()
        self._onset_ns = state.onset_ns
        if state.onset_ns is not None:
            self._path.append(state.mean[:2])
            self._scene, self._stamp_ns = step.scene, state.stamp_ns

    def finish(self) -> None:
        """End the movement; learn it if it ends at a goal and was not known."""
        path, self._path = np.array(self._path), []
        goals, frame_id = self._scene.goals, self._pipeline.frame_id
        if len(path) < 2 or goals is None or not len(goals) or frame_id is None:
            return
        goal, distance_m = find_goal_at_end(path, goals)
        if np.hypot(*np.diff(path, axis=0).T).sum() < SHORTEST_M or distance_m > AT_GOAL_M:
            return
        found = record_demonstration(frame_id, np.vstack([path, goals[goal]]), self._scene.obstacles(self._stamp_ns))
        if not any(is_same_demonstration(found, known) for known in self.demonstrations):
            self.demonstrations.append(found)
            self.learned += 1
