# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measure predictions of people: ways, goals and positions; `make people` runs it.

It uses D3IL and two parts of HLP, which have to be beside the checkout (`shared/data`), and writes the tables of doc/people.md.
Each setting is scored on those recordings of D3IL and persons of HLP that no setting was chosen on.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from page import ROOT, SHARED, format_table, write_blocks
from scipy.special import softmax

from foc_ros.analysis.evaluation.baselines import UNCERTAINTY, Forecast, ForecastFunction, forecast_published
from foc_ros.analysis.evaluation.observations import (
    GOAL,
    PATH_CLASS,
    Observation,
    ObservedRecording,
    Question,
    ask_all,
    observe_in_order,
)
from foc_ros.analysis.evaluation.positions import compute_position_scores
from foc_ros.analysis.evaluation.scores import Scores, leave_goals_out, score_forecasts, score_other_goal, summarise
from foc_ros.analysis.evaluation.truth import HORIZONS_S
from foc_ros.analysis.parallel import collect_all, open_workers
from foc_ros.analysis.recordings import Recording, find_recordings, group_by_operator
from foc_ros.core.config import Config
from foc_ros.core.errors import RecordingError
from foc_ros.ros.parameters import load_parameter_file

PAGE, EXAMPLES = ROOT / 'doc' / 'people.md', ROOT / 'doc' / 'examples'
D3IL, HLP, PICKS = 'd3il_avoiding', 'hlp_reaching', 'hlp_picks'
RARE = Config().with_values({'rate_hz': 4.0})
HAND = Config().with_values({'scene.hand_radius': 0.0125, 'rate_hz': 4.0})
UNLEARNT = {'duration.adaptation': 'none', 'covariance.adaptation': 'none', 'experience.learning': 'none'}
SETTINGS = {
    (D3IL, 'defaults, nothing learnt'): RARE.with_values(UNLEARNT),
    (D3IL, 'defaults, pace learnt'): RARE.with_values(UNLEARNT | {'duration.adaptation': 'online'}),
    (D3IL, 'defaults'): RARE,
    (D3IL, 'thumb_stick.yaml'): load_parameter_file(EXAMPLES / 'thumb_stick.yaml').with_values({'rate_hz': 4.0}),
    (HLP, 'defaults, nothing learnt'): HAND.with_values(UNLEARNT),
    (HLP, 'defaults'): HAND,
    (HLP, 'free_hand.yaml'): load_parameter_file(EXAMPLES / 'free_hand.yaml').with_values({'rate_hz': 4.0}),
}
PICK = Config().with_values({'rate_hz': 10.0})
OTHER_SCORES = {'area_under_curve_half_way': 2, 'calibration_error': 3, 'loss': 3}
"""Scores of the share of another goal, with their digits."""
POINTS = np.linspace(0.1, 0.9, 9)
"""Shares of the way at which goals are asked for."""
ROUNDING = 1e-9
AHEAD_S, DISTANCE_M = 0.25, 0.05
"""Time ahead [s] and scale of the distance of the simple rule for goals [m], which is the best one for the other persons."""


def is_held_out(name: str) -> bool:
    """Tell whether no setting was chosen on a recording of D3IL: its number is even."""
    return int(name) % 2 == 0


def find_persons(data: Path) -> dict[str, list[Recording]]:
    """Return the recordings of each person that no setting was chosen on; D3IL does not tell its persons apart.

    Settings were chosen on the recordings of D3IL with odd numbers, and on every other person of HLP from the first, or on those
    whose numbers are no multiples of four.
    """
    found = group_by_operator(find_recordings(data))
    if data.name == PICKS:
        return {person: recordings for person, recordings in found.items() if int(person.rpartition('_')[2]) % 4 == 0}
    if len(found) == 1:
        return {person: [each for each in recordings if is_held_out(each.name)] for person, recordings in found.items()}
    return {person: found[person] for person in sorted(found)[1::2]}


def score(recordings: Sequence[ObservedRecording], name: str, forecast: ForecastFunction = forecast_published) -> Scores:
    """Return the scores of the forecasts that answer a question."""
    asked = [(n, each, question) for n, seen in enumerate(recordings) for each, question in ask_all(seen, name)]
    return score_forecasts((n, each, question, forecast(each, question, None)) for n, each, question in asked)


def forecast_by_distance(observation: Observation, question: Question, _: None) -> Forecast:
    """Forecast the goal by its distance from where the hand would be at its velocity."""
    ahead = observation.hand[:2] + AHEAD_S * observation.hand[2:4]
    shares = softmax(-np.hypot(*(observation.goals - ahead).T) / DISTANCE_M)
    return Forecast.from_answer_shares(shares, question, UNCERTAINTY)


def format_ways(recordings: Sequence[ObservedRecording]) -> tuple[str, ...]:
    """Return gain, share correct, calibration error and the worst tenth of the forecasts of the ways."""
    found = summarise(score(recordings, PATH_CLASS))
    worst = min(each['gain'] for each in found['by_tenth'] if each['gain'] is not None)
    values = found['gain'], 100 * found['right'], found['expected_calibration_error'], worst
    return tuple(f'{value:.{digits}f}' for value, digits in zip(values, (3, 1, 3, 2), strict=True))


def take_before(scores: Scores, share: float) -> Scores:
    """Return the scores of the last prediction of each recording before the hand had covered a share of its way."""
    before = np.flatnonzero(scores.progress <= share + ROUNDING)
    is_last = np.diff(scores.recording[before], append=-1) != 0
    return scores.take(before[is_last])


def format_goals(recordings: Sequence[ObservedRecording], forecast: ForecastFunction = forecast_published) -> tuple[str, ...]:
    """Return scores of the goals at `POINTS`, each of which counts the same, as does each recording.

    These are gain, the least gain, shares correct of all and half way, and calibration error.
    """
    scores = score(recordings, GOAL, forecast)
    points = [take_before(scores, share) for share in POINTS]
    gain = np.array([summarise(each)['gain'] for each in points])
    right = np.array([each.correct.mean() for each in points])
    found = summarise(Scores(*map(np.concatenate, zip(*points, strict=True))))
    values = gain.mean(), gain.min(), 100 * right.mean(), 100 * right[4], found['expected_calibration_error']
    return tuple(f'{value:.{digits}f}' for value, digits in zip(values, (3, 2, 1, 1, 3), strict=True))


def format_other(recordings: Sequence[ObservedRecording], left_out: Sequence[ObservedRecording], prior: float) -> tuple[str, ...]:
    """Return area under the curve half way, calibration error and loss; arguments as in `score_other_goal`."""
    found = score_other_goal(recordings, left_out, prior)
    assert found is not None
    return tuple(f'{found[name]:.{digits}f}' for name, digits in OTHER_SCORES.items())


def format_positions(recordings: Sequence[ObservedRecording]) -> tuple[str, ...]:
    """Return errors [mm] of the most likely candidate, NLPDs of the mixture and of the Singer model, and shares in regions."""
    scores, names = compute_position_scores(recordings), [f'{each:g}' for each in HORIZONS_S]
    errors = [1e3 * scores['displacement_m']['most likely']['final'][name] for name in names]
    nlpd = [[scores['nlpd'][each][name] for name in names] for each in ('foc', 'Singer Kalman')]
    inside = [[100 * scores['inside_all'][level][name] for name in names] for level in ('0.5', '0.9')]
    rows = zip((errors, *nlpd, *inside), (0, 2, 2, 0, 0), strict=True)
    return tuple(' '.join(f'{value:.{digits}f}' for value in row) for row, digits in rows)


def observe_persons(persons: Mapping[str, Sequence[Recording]], config: Config, title: str) -> list[ObservedRecording]:
    """Observe the recordings of each person in their order; raise RecordingError where one cannot be used."""
    observed = collect_all(partial(observe_in_order, config=config), list(persons.items()), title)
    for name, reason in [failure for _, failed in observed for failure in failed.items()]:
        raise RecordingError(f'{name}: {reason}')
    return [recording for each, _ in observed for recording in each]


def main() -> None:
    """Measure and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--every', type=int, default=1, help='use every n-th recording of a person only')
    parser.add_argument('--workers', type=int, default=len(os.sched_getaffinity(0)), metavar='N', help='worker processes')
    arguments = parser.parse_args()
    ways, positions = [], []
    with open_workers(arguments.workers):
        for (data, setting), config in SETTINGS.items():
            items = {person: found[:: arguments.every] for person, found in find_persons(SHARED / data).items()}
            recordings = observe_persons(items, config, f'{data}: {setting}')
            ways.append((data, setting, *format_ways(recordings)))
            positions.append((data, setting, *format_positions(recordings)))
        items = {person: found[:: arguments.every] for person, found in find_persons(SHARED / PICKS).items()}
        recordings = observe_persons(items, PICK, f'{PICKS}: defaults')
        goals = [
            ('defaults', *format_goals(recordings)),
            ('distance 0.25 s ahead', *format_goals(recordings, forecast_by_distance)),
        ]
        without = {person: [*leave_goals_out({each.name: each for each in found}).values()] for person, found in items.items()}
        left_out = observe_persons(without, PICK, f'{PICKS}: without the goals that were reached')
        others = format_other(recordings, left_out, PICK.likelihood.other_goal)
    heads = 'gain [nat]', 'right [%]', 'ECE', 'worst tenth [nat]'
    measures = 'error [mm]', 'NLPD', 'NLPD, Singer', 'in 50 % region [%]', 'in 90 % region [%]'
    asked = 'rule', 'gain [nat]', 'worst point [nat]', 'right [%]', 'right half way [%]', 'ECE'
    tables = {
        'ways': (('data', 'parameters', *heads), ways),
        'goals': (asked, goals),
        'other': (('area half way', 'calibration error', 'loss [nat]'), [others]),
        'positions': (('data', 'parameters', *measures), positions),
    }
    write_blocks({name: format_table(*table) for name, table in tables.items()}, PAGE)


if __name__ == '__main__':
    main()
