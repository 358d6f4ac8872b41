"""Measure predictions with recordings of the same scene, by their number; `make people` runs it.

It uses D3IL, which has to be beside the checkout (`shared/data`), and writes a table of doc/people.md. The recordings with even
numbers are predicted with some of those with odd numbers as experience. Beside them are the nearest recordings alone, without a
model: a mixture of normal distributions about their paths, which begin at the hand.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import numpy as np
from accuracy.data_sets import SHARED
from accuracy.page import format_table, write_blocks
from people import D3IL, EXAMPLES, PAGE, PUBLISHED, format_ways, is_held_out, score_ways

from foc_ros.analysis.evaluation.ground_truth import HORIZONS_S
from foc_ros.analysis.evaluation.observations import Observation, ObservedRecording, observe
from foc_ros.analysis.evaluation.position_metrics import HORIZONS, compute_position_scores, log_mixture_density
from foc_ros.analysis.learn_demonstrations import learn_recording
from foc_ros.analysis.parallel import collect, collect_all, open_executor
from foc_ros.analysis.recordings import Recording, find_recordings
from foc_ros.cli.arguments import add_worker_arguments
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.learning.recordings import Library, find_evidence, follow_recordings, make_library
from foc_ros.core.types import Array, HandState, make_obstacles
from foc_ros.io.class_library import save_library
from foc_ros.ros.parameters import load_parameter_file

CONFIG = load_parameter_file(EXAMPLES / 'thumb_stick.yaml').with_values({'rate_hz': 4.0})
NUMBERS = (0, 8, 16, 24)
"""Numbers of recordings; the last one is that of all with odd numbers."""
SPREAD_M, DRIFT = 0.001, 0.02
"""Standard deviation about the path of a recording, at once [m] and for each second more [m/s], the best one of three."""


def predict_by_nearest(observation: Observation, library: Library, frame_id: str) -> tuple[Array, Array]:
    """Return the weights (e,) of the nearest recordings and where they lead the hand (e, h, 2) [m] at HORIZONS_S.

    All recordings have some weight, however far they are: without a model, there is nothing else to rely on.
    """
    hand = HandState(observation.stamp_ns, observation.hand, np.zeros((6, 6)), frame_id=frame_id)
    obstacles = make_obstacles(observation.centre, 0.0, ids=observation.ids)
    for widening in (2.0 ** np.arange(16)).tolist():
        evidence = find_evidence(library, hand, obstacles, observation.goals, widening)
        if len(evidence.row):
            break
    recorded = follow_recordings(library, evidence, np.full(len(evidence.row), np.inf), hand, np.array(HORIZONS_S))
    return evidence.weight / evidence.weight.sum(), recorded.paths


def score_nearest(recordings: Sequence[ObservedRecording], library: Library, frame_id: str) -> tuple[Array, Array]:
    """Return the mean errors [m] and negative log-densities (h,) of the nearest recordings."""
    errors, densities = [], []
    variance = (SPREAD_M + DRIFT * np.array(HORIZONS_S)) ** 2
    for each in [observation for recording in recordings for observation in recording.observations]:
        weight, paths = predict_by_nearest(each, library, frame_id)
        true = each.truth.positions[HORIZONS]
        errors.append(np.hypot(*(np.tensordot(weight, paths, 1) - true).T))
        round_ = np.broadcast_to(variance, paths.shape[:2])
        densities.append(-log_mixture_density(weight, true - paths, round_, round_, np.zeros_like(round_)))
    return np.nanmean(errors, axis=0), np.nanmean(densities, axis=0)


def observe_with(found: Sequence[Demonstration], recordings: Sequence[Recording], executor: Executor) -> list[ObservedRecording]:
    """Replay recordings with others as experience."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / 'library.json'
        save_library(file, found)
        config = CONFIG.with_values({'homotopy.library': str(file)}) if found else CONFIG
        items = [(each.name, each) for each in recordings]
        return collect_all(partial(observe, config=config), items, executor, f'{len(found)} recordings')


def format_errors(errors: Sequence[float]) -> str:
    """Return errors [m] in mm."""
    return ' '.join(f'{1e3 * each:.0f}' for each in errors)


def format_densities(densities: Sequence[float]) -> str:
    """Return negative log-densities."""
    return ' '.join(f'{each:.2f}' for each in densities)


def measure(found: Sequence[Demonstration], recordings: Sequence[Recording], executor: Executor) -> list[tuple[str, ...]]:
    """Return the rows of one draw: of the predictions, and of the nearest recordings alone."""
    observed = observe_with(found, recordings, executor)
    scores, names = compute_position_scores(observed), [f'{each:g}' for each in HORIZONS_S]
    gain = format_ways(score_ways(observed, PUBLISHED, [0] * len(observed)))[0]
    errors = [scores['displacement_m'][each]['final'] for each in ('most likely', 'likelihood-weighted')]
    likeliest, mean = (format_errors([each[name] for name in names]) for each in errors)
    rows = [('foc', gain, likeliest, mean, format_densities([scores['nlpd']['foc'][name] for name in names]))]
    if found:
        nearest = score_nearest(observed, make_library(found), found[0].frame_id)
        rows.append(('nearest recordings', '', '', format_errors(nearest[0].tolist()), format_densities(nearest[1].tolist())))
    return [(f'{len(found)}', *row) for row in rows]


def main() -> None:
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--every', type=int, default=1, help='predict every n-th of the recordings only')
    parser.add_argument('--draws', type=int, default=3, help='number of random choices of the recordings')
    add_worker_arguments(parser)
    arguments = parser.parse_args()
    recordings = list(find_recordings(SHARED / D3IL).values())
    known, predicted = ([each for each in recordings if is_held_out(each.name) == held_out] for held_out in (False, True))
    rows = []
    with open_executor(arguments) as executor:
        learn = partial(learn_recording, config=CONFIG)
        learnt = [each for part in collect(learn, [(each.name, each) for each in known], executor, 'learn')[0] for each in part]
        for number in NUMBERS:
            for seed in range(arguments.draws if 0 < number < len(learnt) else 1):
                drawn = np.random.default_rng([seed, number]).permutation(len(learnt))[:number]
                found = [learnt[each] for each in sorted(drawn.tolist())]
                rows += measure(found, predicted[:: arguments.every], executor)
    titles = 'recordings', 'predictor', 'ways, gain [nat]', 'error of the likeliest [mm]', 'error of the mean [mm]', 'NLPD'
    write_blocks({'learning': format_table(titles, rows)}, PAGE)


if __name__ == '__main__':
    main()
