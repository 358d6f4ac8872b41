"""Measure predictions of people: ways, positions, persons left out and what is learnt of them; `make people` runs it.

It uses D3IL and HLP, which have to be beside the checkout (`shared/data`), and writes the tables of doc/people.md. Each setting
is scored on those recordings of D3IL and persons of HLP that no setting was chosen on.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import numpy as np
from accuracy.data_sets import SHARED
from accuracy.page import ROOT, format_table, write_blocks

from foc_ros.analysis.evaluation.baselines import Baseline, forecast_shares, make_plain_rules
from foc_ros.analysis.evaluation.cross_validation import choose_held_out, compute_log_likelihoods
from foc_ros.analysis.evaluation.forecasts import power_rule_shares, published_shares
from foc_ros.analysis.evaluation.ground_truth import HORIZONS_S
from foc_ros.analysis.evaluation.metrics import Scores, score_forecasts, summarise
from foc_ros.analysis.evaluation.observations import ObservedRecording, observe_in_order
from foc_ros.analysis.evaluation.position_metrics import compute_position_scores
from foc_ros.analysis.evaluation.questions import PATH_CLASS, ask_all
from foc_ros.analysis.fitting.duration_fit import find_samples
from foc_ros.analysis.fitting.recorded_hand import RecordedHand, read_hand
from foc_ros.analysis.parallel import collect, collect_all, open_executor
from foc_ros.analysis.recordings import Recording, find_recordings, group_by_operator
from foc_ros.cli.arguments import add_worker_arguments
from foc_ros.core.config import Config
from foc_ros.core.errors import RecordingError
from foc_ros.core.hand.duration import estimate_times_to_go
from foc_ros.core.learning.pace import Pace
from foc_ros.ros.parameters import load_parameter_file

PAGE, EXAMPLES = ROOT / 'doc' / 'people.md', ROOT / 'doc' / 'examples'
D3IL, HLP = 'd3il_avoiding', 'hlp_reaching'
ROOM = Config().with_values({'homotopy.max_candidates': 24, 'rate_hz': 4.0})
HAND = Config().with_values({'scene.hand_radius': 0.0125, 'rate_hz': 4.0})
UNLEARNT = {f'{each}.adaptation': 'none' for each in ('duration', 'covariance')}
SETTINGS = {
    (D3IL, 'defaults, nothing learnt'): ROOM.with_values(UNLEARNT),
    (D3IL, 'defaults, pace learnt'): ROOM.with_values({'covariance.adaptation': 'none'}),
    (D3IL, 'defaults'): ROOM,
    (D3IL, 'thumb_stick.yaml'): load_parameter_file(EXAMPLES / 'thumb_stick.yaml').with_values({'rate_hz': 4.0}),
    (HLP, 'defaults, nothing learnt'): HAND.with_values(UNLEARNT),
    (HLP, 'defaults'): HAND,
    (HLP, 'free_hand.yaml'): load_parameter_file(EXAMPLES / 'free_hand.yaml').with_values({'rate_hz': 4.0}),
}
PUBLISHED = Baseline('published', partial(forecast_shares, published_shares), (None,))
CURVE = (0, 1, 2, 4, 8)
"""Numbers of earlier movements after which the time to go is scored."""

Persons = dict[str, list[Recording]]


def is_held_out(name: str) -> bool:
    """Tell whether no setting was chosen on a recording of D3IL: its number is even."""
    return int(name) % 2 == 0


def find_persons(data: Path) -> Persons:
    """Return the recordings of each person that no setting was chosen on; D3IL does not tell its persons apart.

    Settings were chosen on the recordings of D3IL with odd numbers, and on every other person of HLP from the first.
    """
    found = group_by_operator(find_recordings(data))
    if len(found) == 1:
        return {person: [each for each in recordings if is_held_out(each.name)] for person, recordings in found.items()}
    return {person: found[person] for person in sorted(found)[1::2]}


def score_ways(recordings: Sequence[ObservedRecording], baseline: Baseline, chosen: Sequence[int]) -> Scores:
    """Score forecasts of the ways, each with the setting chosen for its recording."""
    return score_forecasts(
        (number, each.truth.progress, question, baseline.forecast(each, question, baseline.settings[chosen[number]]))
        for number, recording in enumerate(recordings)
        for each, question in ask_all(recording, PATH_CLASS)
    )


def format_ways(scores: Scores) -> tuple[str, ...]:
    """Return gain, share correct, calibration error and the worst tenth."""
    found = summarise(scores)
    worst = min(each['gain'] for each in found['by_tenth'] if each['gain'] is not None)
    values = found['gain'], 100 * found['right'], found['expected_calibration_error'], worst
    return tuple(f'{value:.{digits}f}' for value, digits in zip(values, (3, 1, 3, 2), strict=True))


def format_positions(recordings: Sequence[ObservedRecording]) -> tuple[str, ...]:
    """Return errors [mm] of the most likely candidate, NLPDs of the mixture and of the Singer model, and shares in regions."""
    scores, names = compute_position_scores(recordings), [f'{each:g}' for each in HORIZONS_S]
    errors = [1e3 * scores['displacement_m']['most likely']['final'][name] for name in names]
    nlpd = [[scores['nlpd'][each][name] for name in names] for each in ('foc', 'Singer Kalman')]
    inside = [[100 * scores['inside_all'][level][name] for name in names] for level in ('0.5', '0.9')]
    rows = zip((errors, *nlpd, *inside), (0, 2, 2, 0, 0), strict=True)
    return tuple(' '.join(f'{value:.{digits}f}' for value in row) for row, digits in rows)


def compare_pace(hands: Sequence[RecordedHand]) -> Iterator[tuple[int, float, float]]:
    """Yield the number of movements judged before each movement of a person, and the mean errors of its time to go [s].

    The first error is that of the defaults, the second one that with the pace learnt so far.
    """
    config, pace = Config(), Pace()
    for hand in hands:
        first, *others = hand.estimate_states(config)
        pace = pace.follow(first, hand.goals, config.duration)  # this ends the movement of the recording before
        if samples := find_samples(hand, config):
            before, after = (
                np.mean([abs(estimate_times_to_go(state, goal[None], each)[0] - left) for state, goal, left in samples])
                for each in (config.duration, pace.adapt(config.duration))
            )
            yield pace.movements, float(before), float(after)
        for state in others:
            pace = pace.follow(state, hand.goals, config.duration)


def measure_pace(persons: Persons, executor: Executor) -> list[tuple[str, ...]]:
    """Return the rows of the learning curve."""
    found = []
    for recordings in persons.values():
        hands, _ = collect(partial(read_hand, config=Config()), [(each.name, each) for each in recordings], executor, 'read')
        found += list(compare_pace(hands))
    table, rows = np.array(found), []
    for low, high in zip(CURVE, (*CURVE[1:], np.inf), strict=True):
        part = table[(table[:, 0] >= low) & (table[:, 0] < high)]
        if len(part):
            errors = [f'{each:.3f}' for each in part[:, 1:].mean(axis=0)]
            rows.append((f'{low}' if high <= low + 1 else f'from {low}', f'{len(part)}', *errors))
    return rows


def main() -> None:
    """Measure and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--every', type=int, default=1, help='use every n-th recording of a person only')
    add_worker_arguments(parser)
    arguments = parser.parse_args()
    ways, positions, left_out, pace = [], [], [], []
    with open_executor(arguments) as executor:
        for (data, setting), config in SETTINGS.items():
            persons = find_persons(SHARED / data)
            items = [(person, found[:: arguments.every]) for person, found in persons.items()]
            observed = collect_all(partial(observe_in_order, config=config), items, executor, f'{data}: {setting}')
            recordings = [recording for each, _ in observed for recording in each]
            for name, reason in [failure for _, failed in observed for failure in failed.items()]:
                raise RecordingError(f'{name}: {reason}')
            ways.append((data, setting, *format_ways(score_ways(recordings, PUBLISHED, [0] * len(recordings)))))
            positions.append((data, setting, *format_positions(recordings)))
            if data == HLP:
                rules = Baseline(
                    'foc', partial(forecast_shares, power_rule_shares), make_plain_rules(recordings, config.likelihood)
                )
                table = np.array([compute_log_likelihoods(ask_all(each, PATH_CLASS), rules) for each in recordings])
                chosen = choose_held_out(table, [each.name.rpartition('_')[0] for each in recordings])
                left_out.append((setting, *format_ways(score_ways(recordings, rules, chosen.tolist()))))
        for data in (D3IL, HLP):
            pace += [(data, *row) for row in measure_pace(find_persons(SHARED / data), executor)]
    titles = 'gain [nat]', 'right [%]', 'ECE', 'worst tenth [nat]'
    write_blocks(
        {
            'ways': format_table(('data', 'parameters', *titles), ways),
            'positions': format_table(
                ('data', 'parameters', 'error [mm]', 'NLPD', 'NLPD, Singer', 'in 50 % region [%]', 'in 90 % region [%]'),
                positions,
            ),
            'persons': format_table(('parameters', *titles), left_out),
            'pace': format_table(('data', 'movements before', 'movements', 'defaults [s]', 'pace learnt [s]'), pace),
        },
        PAGE,
    )


if __name__ == '__main__':
    main()
