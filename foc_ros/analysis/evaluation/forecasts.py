"""Predictors to compare: each turns an observation into shares of its candidates, or names one answer.

What a predictor leaves over, it leaves to the open answers in equal parts. So the one-answer baselines get a confidence, and
every predictor the least doubt `DOUBT`: an answer that is not among the candidates is unlikely, not impossible. A candidate that
could not be solved is unknown, not unlikely: it counts as much as those that were solved do on average.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.likelihood import compute_likelihoods, compute_shared_cost
from foc_ros.core.types import LEFT, RIGHT, Array, Record

from .minimum_jerk import straight_cost
from .observations import Observation
from .questions import GOAL, Answer, Question

DOUBT = 0.01
TIE = 1e-12

Shares = Callable[[Observation], Array]
"""Shares (k,) of the candidates, summing to 1."""
Guess = Callable[[Observation, Question], Answer]
"""The one answer to a question."""


@dataclass(frozen=True, eq=False)
class Forecast(Record):
    """Probabilities of the m answers of a question (m,); each_other: of each open answer that no candidate gives."""

    probability: Array
    each_other: float

    def true(self, question: Question) -> float:
        """Return the probability of what came true."""
        return float(self.probability[question.truth])

    def confidence(self) -> float:
        """Return the probability of the likeliest answer."""
        return float(max(self.probability.max(), self.each_other))

    def right(self, question: Question) -> float:
        """Return 1 where the likeliest answer came true, 0 where not; of equally likely ones, each counts its part."""
        held = self.probability >= self.confidence() - TIE
        unlisted = question.unlisted if self.each_other >= self.confidence() - TIE else 0
        return float(held[question.truth] / (held.sum() + unlisted))


def of_shares(shares: Array, question: Question) -> Forecast:
    """Sum the candidates' shares by their answers; shares (k,): of all candidates, unknown ones included."""
    return _with_rest(np.bincount(question.given, shares, len(question.answers)).astype(float), question, DOUBT)


def of_guess(answer: Answer, confidence: float, question: Question) -> Forecast:
    """Give one answer a confidence in [0, 1 - DOUBT]."""
    named = np.array([1.0 if each == answer else 0.0 for each in question.answers])
    return _with_rest(named, question, 1.0 - confidence)


def uniform(question: Question) -> Forecast:
    """Give all open answers the same probability."""
    return _with_rest(np.zeros(len(question.answers)), question, 1.0)


def _with_rest(shares: Array, question: Question, rest: float) -> Forecast:
    each = rest / question.open
    return Forecast((1.0 - rest) * shares + each * question.is_open, each)


def published(seen: Observation) -> Array:
    """Return the likelihoods that the node publishes."""
    return _with_unknown(seen, seen.ways.likelihood[seen.ways.solved])


def power_rule(seen: Observation, config: LikelihoodConfig) -> Array:
    """Return what the node would publish with other parameters of the likelihood."""
    solved, ways = np.flatnonzero(seen.ways.solved), seen.ways
    partings = ways.partings.take(solved)
    return _with_unknown(
        seen, compute_likelihoods(compute_shared_cost(ways.spent, config) + ways.to_go[solved], config, partings)
    )


def boltzmann(seen: Observation, inverse_temperature: float) -> Array:
    """Return the maximum-entropy rule, exp(-b J), b the inverse temperature [s^5/m^2]; effort spent is the same for all."""
    to_go = seen.ways.to_go[seen.ways.solved]
    weights = np.exp(-inverse_temperature * (to_go - to_go.min()))
    return _with_unknown(seen, weights / weights.sum())


def _with_unknown(seen: Observation, solved: Array) -> Array:
    """Return shares (k,) of all candidates from those of the solved ones, which sum to 1."""
    shares = np.full(len(seen.ways), 1.0 / len(seen.ways))
    shares[seen.ways.solved] = solved * (len(solved) / len(seen.ways))
    return shares


def shortest_path(seen: Observation, question: Question) -> Answer:
    """Name the answer of the shortest path."""
    return question.answers[question.given[int(seen.ways.length.argmin())]]


def constant_velocity(seen: Observation, question: Question) -> Answer:
    """Go on at the present velocity; a hand at rest goes straight ahead."""
    velocity = seen.hand[2:4] if seen.since_s > 0.0 else seen.along
    return _straight(seen, question, velocity)


def nearest_gap(seen: Observation, question: Question) -> Answer:
    """Pass through the gap straight ahead, to the nearest goal."""
    if question.name == GOAL:
        return (int(np.hypot(*(seen.goals - seen.hand[:2]).T).argmin()),)
    return _straight(seen, question, seen.along)


def _straight(seen: Observation, question: Question, velocity: Array) -> Answer:
    hand = seen.hand[:2]
    if question.name == GOAL:
        return (_toward(seen.goals - hand, velocity),)
    aside = np.array([-seen.along[1], seen.along[0]])
    ahead = seen.centre[question.obstacles] - hand
    # a hand that does not get ahead leaves all obstacles on the side from which it came
    pace = max(float(velocity @ seen.along), 1e-3 * float(np.hypot(*velocity)), 1e-12)
    passes_left = (ahead @ seen.along) * float(velocity @ aside) / pace > ahead @ aside
    return tuple(np.where(passes_left, LEFT, RIGHT).tolist())


def _toward(goals: Array, velocity: Array) -> int:
    """Return the goal (g, 2), as seen from the hand, whose direction is nearest to the velocity's."""
    return int((goals @ velocity / np.maximum(np.hypot(*goals.T), 1e-12)).argmax())


def straight_minimum_jerk(seen: Observation, question: Question, beta: float, confidence: float) -> Forecast:
    """Weigh straight movements to the goals by the ratios of their efforts; each answers as its straight line does.

    confidence: in the whole of it, in [0, 1 - DOUBT].
    """
    shares = compute_likelihoods(straight_cost(seen), LikelihoodConfig(beta=beta))
    ways = seen.goals - seen.hand[:2]
    given = [(goal,) if question.name == GOAL else _straight(seen, question, way) for goal, way in enumerate(ways)]
    total = np.zeros(len(question.answers))
    for share, answer in zip(shares, given, strict=True):
        if answer in question.answers:
            total[question.answers.index(answer)] += share
    return _with_rest(total, question, 1.0 - confidence)
