#!/usr/bin/env python3
"""Measure how many candidates take part in predictions, how likely the class really taken was, and the CPU time.

    python scripts/measure_candidates.py [DATA ...] [--set NAME=VALUE ...] [--every N] [--budget S]

DATA: bags, or folders as `foc_ros evaluate` reads them; by default the packaged recording, and D3IL and HLP where they are beside
the checkout. `--set rate_hz=10` predicts ten times a second; `--budget 0.01` limits the time of each prediction to 10 ms.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from accuracy.data_sets import DataSet, find_data_sets, load_data_set
from accuracy.page import parse_setting, print_table

from foc_ros.analysis.evaluation.baselines import POWERS
from foc_ros.analysis.evaluation.forecasts import Forecast, power_rule_shares, published_shares
from foc_ros.analysis.evaluation.ground_truth import RecordedPath
from foc_ros.analysis.evaluation.observations import Observation, make_observation
from foc_ros.analysis.evaluation.questions import PATH_CLASS, Question, ask
from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay, Step
from foc_ros.core.config import Config
from foc_ros.core.types import Array, HandState
from foc_ros.io.topics import HAND

HEAD = (
    'data', 'predictions', 'candidates', 'take part [%]', 'solved [%]', 'empty [%]', 'way taken is a candidate [%]',
    'log-likelihood [nat]', 'missing as 0', 'best beta', 'log-likelihood with it', 'with it, missing as 0',
    'uniform', 'CPU [ms]', '99 %',
)  # fmt: skip


@dataclass(frozen=True)
class Measured:
    """The predictions of a data set.

    counts (p, 3): candidates, those that take part, and those that are solved; seconds (p,): CPU time of each; asked: those
    predictions of which the class really taken is asked, with the question.
    """

    counts: Array
    seconds: Array
    asked: list[tuple[Observation, Question]]

    def compute_log_likelihood(self, config: Config, *, is_refit: bool, is_missing_average: bool) -> float:
        """Return the mean log-likelihood of the class really taken.

        A class that takes no part is unknown and counts as much as the others do on average, or it counts 0. A prediction
        without any class that takes part is uniform. is_refit: with the likelihoods of the config, not those published.
        """
        total = 0.0
        for observation, question in self.asked:
            takes_part = observation.candidates.has_likelihood
            shares = power_rule_shares(observation, config.likelihood) if is_refit else published_shares(observation)
            if not takes_part.any():
                forecast = Forecast.uniform(question)
            elif is_missing_average:
                forecast = Forecast.from_shares(shares, question)
            else:
                forecast = Forecast.from_shares(np.where(takes_part, shares, 0.0) / shares[takes_part].sum(), question)
            total += float(np.log(forecast.true_probability(question)))
        return total / len(self.asked)

    def find_best_beta(self, config: Config, *, is_missing_average: bool) -> tuple[float, float]:
        """Return the exponent of those that `evaluate` tries that is best, and the log-likelihood with it."""
        compute = partial(self.compute_log_likelihood, is_refit=True, is_missing_average=is_missing_average)
        found = [(compute(replace(config, likelihood=replace(config.likelihood, beta=beta))), beta) for beta in POWERS]
        best, beta = max(found)
        return beta, best


def measure(data: DataSet, config: Config, budget_s: float | None = None) -> Measured:
    """Replay all recordings of a data set."""
    counts: list[tuple[int, int, int]] = []
    seconds: list[float] = []
    asked: list[tuple[Observation, Question]] = []
    for recording in data.recordings.values():
        for movement in _replay(recording, Replay(config, budget_s), seconds):
            path = RecordedPath(np.array(movement.stamps), np.array(movement.positions), movement.goals)
            for step, hand in movement.made:
                assert step.prediction is not None
                candidates = step.prediction.candidates
                takes_part = sum(each.has_likelihood for each in candidates)
                counts.append((len(candidates), takes_part, sum(each.is_solved for each in candidates)))
                if candidates and hand.stamp_ns <= path.end_ns:
                    observation = make_observation(step, hand, path, config)
                    question = ask(PATH_CLASS, observation, frozenset(observation.ids))
                    asked += [(observation, question)] if question is not None else []
    return Measured(np.array(counts, dtype=float), np.array(seconds), asked)


@dataclass
class Movement:
    """The samples of a hand while its goals are the same, and the predictions, each with the state of the hand."""

    goals: Array
    stamps: list[int] = field(default_factory=list)
    positions: list[Array] = field(default_factory=list)
    made: list[tuple[Step, HandState]] = field(default_factory=list)


def _replay(recording: Recording, replayed: Replay, seconds: list[float]) -> list[Movement]:
    """Return the movements of a recording; append the CPU time of each prediction."""
    movements = [Movement(np.zeros((0, 2)))]
    for step in _time_steps(replayed, recording, seconds):
        if step.sample is None:
            continue
        goals = step.scene.goals
        if goals is not None and not np.array_equal(goals, movements[-1].goals):
            movements.append(Movement(goals))
        movements[-1].stamps.append(step.sample.stamp_ns)
        movements[-1].positions.append(step.sample.position)
        if step.prediction is not None:
            assert replayed.pipeline.hand_state is not None
            movements[-1].made.append((step, replayed.pipeline.hand_state))
    return [each for each in movements if each.made]


def _time_steps(replayed: Replay, recording: Recording, seconds: list[float]) -> Iterator[Step]:
    for item in recording.items():
        if item.role == HAND:
            began = time.process_time()
            (step,) = replayed.steps([item])
            if step.prediction is not None:
                seconds.append(time.process_time() - began)
        else:
            (step,) = replayed.steps([item])
        yield step


def summarise(name: str, measured: Measured, config: Config) -> list[str]:
    """Return the cells of a data set under `HEAD`."""
    found, takes_part, solved = measured.counts.sum(axis=0)
    cells = [name, str(len(measured.counts)), f'{found:.0f}', f'{100 * takes_part / found:.2f}', f'{100 * solved / found:.2f}']
    cells.append(f'{100 * np.mean(measured.counts[:, 1] == 0):.2f}')
    cells.append(f'{100 * np.mean([bool((each.given == each.truth).any()) for _, each in measured.asked]):.2f}')
    betas = []
    for average in (True, False):
        likelihood = measured.compute_log_likelihood(config, is_refit=False, is_missing_average=average)
        cells.append(f'{likelihood:.3f}')
        betas.append(measured.find_best_beta(config, is_missing_average=average))
    cells += [' / '.join(f'{beta:g}' for beta, _ in betas), *(f'{best:.3f}' for _, best in betas)]
    cells.append(f'{-np.mean([np.log(question.possible) for _, question in measured.asked]):.3f}')
    return [*cells, *(f'{1e3 * value:.2f}' for value in np.percentile(measured.seconds, (50, 99)))]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the data sets of the command line, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data', nargs='*', type=Path, help='bags or folders')
    parser.add_argument('--set', action='append', default=[], type=parse_setting, metavar='NAME=VALUE', help='a parameter')
    parser.add_argument('--every', type=int, default=1, metavar='N', help='every n-th recording only')
    parser.add_argument('--budget', type=float, metavar='S', help='time limit of each prediction [s]')
    chosen = parser.parse_args(arguments)
    config = Config().with_values(dict(chosen.set))
    print(config)
    sets = (load_data_set(path).thin(chosen.every) for path in chosen.data or find_data_sets())
    print_table(HEAD, (summarise(data.name, measure(data, config, chosen.budget), config) for data in sets))


if __name__ == '__main__':
    main()
