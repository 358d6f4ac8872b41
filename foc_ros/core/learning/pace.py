"""What is learnt of an operator: how they arrive, and the factor by which they take longer than the duration model expects.

When a movement has covered most of its distance to a goal, both arrivals, at rest and passing, with every factor f of `FACTORS`
are judged by the positions that they would have led to. At a time t, the time to go T_f(t) is estimated with all expected
durations multiplied by f. Where the free movement to the goal in T_f(t) would be h = `AHEAD_S` later is compared with where the
hand x was then, relative to how far it had moved:

    l_f = sum_t |x_f(t + h) - x(t + h)| / sum_t |x(t + h) - x(t)|.

The arrival and the factor in use minimise w log(f)^2 + w' + sum l_f over the movements so far, as a regularised leader
(Shalev-Shwartz 2012, Foundations and Trends in Machine Learning 4(2)), with the weight w of `PRIOR_WEIGHT` and w' of
`ARRIVAL_WEIGHT` for the arrival that `duration.arrival` does not name: without movements the factor is 1, and both adapt in the
course of a few. They depend on the samples and goals alone, so that equal input gives equal factors.

The free movement has the least integral of squared jerk, and begins at the velocity v without acceleration, as predictions do.
After the share s = h / T of its time it has come to

    x_f = x + p(s) (goal - x) + q(s) T v,
    p = 10 s^3 - 15 s^4 + 6 s^5,           q = s - 6 s^3 + 8 s^4 - 3 s^5   if it comes to rest at the goal,
    p = (20 s^3 - 15 s^4 + 3 s^5) / 8,     q = s - p                       if it passes the goal at any velocity.

The time to go itself is no good measure: people slow down before their goal, or move at a constant speed, and a plan of least
jerk is nearest to them with another duration than theirs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from foc_ros.core.config import ARRIVALS, DurationConfig
from foc_ros.core.estimation.duration import estimate_times_to_go, is_passing, scale_durations
from foc_ros.core.types import NANOSECONDS, Array, HandState, Record, as_readonly

from .goal_reached import has_covered_distance
from .judging import choose_judged, sample_movement

FACTORS = as_readonly(np.exp(np.linspace(-0.8, 1.6, 25)))
"""Factors that are judged."""
PRIOR_WEIGHT = 0.1
"""Weight of log(f)^2 against the errors of one movement."""
ARRIVAL_WEIGHT = 0.1
"""Weight of another arrival than that of the parameters, likewise."""
AHEAD_S = 0.5
"""How far ahead positions are judged [s]."""


@dataclass(frozen=True, eq=False)
class Pace(Record):
    """The pace and arrival of an operator, from the movements so far.

    movements: how many were judged; losses (2, f): sum of the errors by `ARRIVALS` and factor, with the prior of the factor;
    states: of the present movement; goals (g, 2): at its last state [m].
    """

    movements: int = 0
    losses: Array = field(default_factory=lambda: np.tile(PRIOR_WEIGHT * np.log(FACTORS) ** 2, (2, 1)))
    states: tuple[HandState, ...] = ()
    goals: Array | None = None

    def find_best(self, config: DurationConfig) -> tuple[str, float]:
        """Return the arrival, and the factor on expected durations, which is exactly 1 before the first movement."""
        if not self.movements:
            return config.arrival, 1.0
        other = np.array([[each != config.arrival] for each in ARRIVALS])
        row, column = np.unravel_index((self.losses + ARRIVAL_WEIGHT * other).argmin(), self.losses.shape)
        return ARRIVALS[row], float(FACTORS[column])

    def adapt(self, config: DurationConfig) -> DurationConfig:
        """Return the durations of this operator."""
        arrival, factor = self.find_best(config)
        return replace(scale_durations(config, factor), arrival=arrival) if self.movements else config

    def follow(self, hand: HandState, goals: Array | None, config: DurationConfig) -> Pace:
        """Return the pace after the next state of the hand; goals (g, 2) [m]; config: before it is adapted."""
        pace = self
        if self.states and self.states[0].onset_ns != hand.onset_ns:
            pace = self._judge(config)
        if hand.onset_ns is None:
            return pace
        states = sample_movement(pace.states, hand)
        return pace if states is pace.states and goals is pace.goals else replace(pace, states=states, goals=goals)

    def interrupt(self) -> Pace:
        """Return the pace without the present movement."""
        return replace(self, states=(), goals=None)

    def _judge(self, config: DurationConfig) -> Pace:
        """Return the pace after the end of the present movement, which counts if it covered the distance to a goal."""
        path, ended = np.array([each.mean[:2] for each in self.states]), self.interrupt()
        first = self.states[0].onset_position
        assert first is not None
        if self.goals is None or not len(self.goals):
            return ended
        goal = self.goals[int(np.hypot(*(self.goals - path[-1]).T).argmin())]
        if not has_covered_distance(np.vstack([first, path]), goal):
            return ended
        errors, moved = self._sum_errors(path, goal, config)
        if not moved:
            return ended
        return replace(ended, movements=self.movements + 1, losses=as_readonly(self.losses + errors / moved))

    def _sum_errors(self, path: Array, goal: Array, config: DurationConfig) -> tuple[Array, float]:
        """Return sums of errors with each arrival and factor (2, f), and the distance that the hand moved meanwhile [m]."""
        seconds = np.array([(each.stamp_ns - self.states[0].stamp_ns) / NANOSECONDS for each in self.states])
        ahead = np.minimum(seconds + AHEAD_S, seconds[-1])
        reached = np.stack([np.interp(ahead, seconds, axis) for axis in path.T], axis=-1)
        scaled = [scale_durations(config, each) for each in FACTORS.tolist()]
        configs = [[replace(each, arrival=arrival) for each in scaled] for arrival in ARRIVALS]
        errors, moved = np.zeros(self.losses.shape), 0.0
        for row in choose_judged(np.flatnonzero(seconds < seconds[-1]).tolist()):
            hand, later_s = self.states[row], float(ahead[row] - seconds[row])
            for number, of_arrival in enumerate(configs):
                times = np.array([estimate_times_to_go(hand, goal[None], each)[0] for each in of_arrival])
                expected = find_free_positions(hand.mean[:4], goal, times, later_s, is_passing(of_arrival[0]))
                errors[number] += np.hypot(*(expected - reached[row]).T)
            moved += float(np.hypot(*(reached[row] - path[row])))
        return errors, moved


def find_free_positions(start: Array, goal: Array, times: Array, seconds: float, passing: bool) -> Array:
    """Return the positions (f, 2) [m] some seconds later in movements of least jerk that reach a goal (2,) in times (f,) [s].

    start (4,): position [m] and velocity [m/s]; passing: whether a movement passes the goal, or comes to rest there.
    """
    s = np.minimum(seconds / times, 1.0)[:, None]
    if passing:
        covered = (20.0 * s**3 - 15.0 * s**4 + 3.0 * s**5) / 8.0
        kept = s - covered
    else:
        covered = 10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5
        kept = s - 6.0 * s**3 + 8.0 * s**4 - 3.0 * s**5
    positions: Array = start[:2] + covered * (goal - start[:2]) + kept * times[:, None] * start[2:]
    return positions
