"""Forecasts: the probabilities that a predictor gives to the answers of a question, and likelihood rules tried on observations.

What a predictor leaves over, such as the unknown share, is spread evenly over the possible answers. Every predictor leaves at
least `UNCERTAINTY`, so that an answer that no candidate gives is unlikely, not impossible. A candidate without a likelihood
counts as the node publishes it: 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.likelihood import OWN_SPREAD, compute_likelihoods
from foc_ros.core.types import Array, Record

from .observations import Observation
from .questions import Answer, Question

UNCERTAINTY = 0.01
TIE = 1e-12


@dataclass(frozen=True, eq=False)
class Forecast(Record):
    """Probabilities of the m answers of a question (m,); each_other: of each possible answer that is not listed."""

    probability: Array
    each_other: float

    @classmethod
    def from_shares(cls, shares: Array, question: Question) -> Forecast:
        """Sum shares (k,) of all candidates by the answers that they give."""
        by_answer = np.bincount(question.given, shares, len(question.answers)).astype(float)
        total = float(by_answer.sum())
        even = by_answer / total if total > 0.0 else by_answer
        return cls.from_answer_shares(even, question, 1.0 - (1.0 - UNCERTAINTY) * min(total, 1.0))

    @classmethod
    def from_answer(cls, answer: Answer, confidence: float, question: Question) -> Forecast:
        """Give one answer a confidence in [0, 1 - UNCERTAINTY]."""
        named = np.array([1.0 if each == answer else 0.0 for each in question.answers])
        return cls.from_answer_shares(named, question, 1.0 - confidence)

    @classmethod
    def from_answer_shares(cls, shares: Array, question: Question, rest: float) -> Forecast:
        """Give the answers their shares (m,) of 1 - rest, and spread the rest evenly over the possible answers."""
        each = rest / question.possible
        return cls((1.0 - rest) * shares + each * question.is_possible, each)

    @classmethod
    def uniform(cls, question: Question) -> Forecast:
        """Give all possible answers the same probability."""
        return cls.from_answer_shares(np.zeros(len(question.answers)), question, 1.0)

    def true_probability(self, question: Question) -> float:
        """Return the probability of the true answer."""
        return float(self.probability[question.truth])

    def confidence(self) -> float:
        """Return the probability of the likeliest answer."""
        return float(max(self.probability.max(), self.each_other))

    def correctness(self, question: Question) -> float:
        """Return 1 where the likeliest answer is true, else 0; each of several equally likely answers counts its part."""
        is_likeliest = self.probability >= self.confidence() - TIE
        unlisted = question.unlisted if self.each_other >= self.confidence() - TIE else 0
        return float(is_likeliest[question.truth] / (is_likeliest.sum() + unlisted))


def published_shares(observation: Observation, _: None = None) -> Array:
    """Return the shares (k,) of the candidates by the likelihoods that the node publishes."""
    return observation.candidates.likelihood


def power_rule_shares(observation: Observation, config: LikelihoodConfig) -> Array:
    """Return the shares (k,) that the node would publish to a known operator with other parameters of the likelihood."""
    candidates = observation.candidates
    solved = np.flatnonzero(candidates.has_likelihood)
    branch_times, shortfalls = candidates.branch_times.take(solved), candidates.safety_shortfall[solved]
    time_s = float(candidates.time_s[solved].min()) if len(solved) else 0.0
    decided = branch_times, shortfalls, candidates.decisions, time_s, OWN_SPREAD
    shares = compute_likelihoods(candidates.cost_to_go[solved], config, *decided)
    return _share_among_solved(observation, shares)


def boltzmann_shares(observation: Observation, inverse_temperature: float) -> Array:
    """Return the maximum-entropy rule exp(-b J), (k,); b: inverse temperature [s^5/m^2]."""
    cost = observation.candidates.cost_to_go[observation.candidates.has_likelihood]
    weights = np.exp(-inverse_temperature * (cost - cost.min()))
    return _share_among_solved(observation, weights / weights.sum())


def _share_among_solved(observation: Observation, solved: Array) -> Array:
    """Return shares (k,) of all candidates from those of the ones that take part; the others have none."""
    shares = np.zeros(len(observation.candidates))
    shares[observation.candidates.has_likelihood] = solved
    return shares
