"""Measure what is learnt from one movement to the next, and show the worst predictions; `make people` runs it.

It uses D3IL and HLP, which have to be beside the checkout (`shared/data`), and writes tables and pictures of doc/people.md. All
recordings of D3IL are replayed in their order, with and without `experience.learning`, and those of each person of HLP on whom no
setting was chosen.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from accuracy.data_sets import SHARED
from accuracy.page import IMAGES, format_table, write_blocks
from people import D3IL, HLP, PAGE, PUBLISHED, SETTINGS, find_persons, format_positions, format_ways, is_held_out, score_ways

from foc_ros.analysis.evaluation.ground_truth import HORIZONS_S
from foc_ros.analysis.evaluation.observations import Observation, ObservedRecording, observe
from foc_ros.analysis.evaluation.position_metrics import compute_position_scores
from foc_ros.analysis.evaluation.questions import PATH_CLASS, Question, ask_all
from foc_ros.analysis.parallel import collect_all, open_executor
from foc_ros.analysis.recordings import Recording, find_recordings
from foc_ros.analysis.replay import Replay, Step
from foc_ros.cli.arguments import add_worker_arguments
from foc_ros.core.config import Config
from foc_ros.core.types import Array, Obstacles
from foc_ros.io.bags import Item
from foc_ros.reporting.draw import get_class_style, make_obstacle_patch, open_figure, save_figure

RUNS = [(D3IL, setting, learning) for setting in ('defaults', 'thumb_stick.yaml') for learning in ('none', 'online')]
RUNS.append((HLP, 'defaults', 'none'))
"""Data, parameters and `experience.learning`. No movement of HLP ends at a goal, because hands stop at the front of an object."""
CURVE = (0, 1, 2, 4, 8, 16, 32)
"""Numbers of earlier movements at which a part of the learning curve begins."""
MIDDLE = f'{HORIZONS_S[1]:g}'
WORST, COLUMNS = 10, 5
LONGEST_NAME = 2
"""Number of letters of an obstacle's name that a picture has room for."""
SHOWN = 3
"""Number of candidates in a picture, the likeliest."""


@dataclass(frozen=True)
class Sketch:
    """What a picture shows of a prediction: the scene, and the paths (m, 2) [m] of all candidates with their likelihoods."""

    obstacles: Obstacles
    goals: Array
    paths: tuple[tuple[float, Array], ...]


class SketchingReplay(Replay):
    """A replay that keeps a sketch of each prediction by its stamp."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.sketches: dict[int, Sketch] = {}

    def steps(self, items: Iterable[Item]) -> Iterator[Step]:
        """Yield the steps of a recording, whose sketches replace those of the recording before."""
        self.sketches = {}
        for step in super().steps(items):
            made = step.prediction
            if made is not None and step.scene.goals is not None:
                paths = tuple((each.likelihood, each.mean[:, :2]) for each in made.candidates_with_likelihood)
                self.sketches[made.stamp_ns] = Sketch(made.obstacles, step.scene.goals, paths)
            yield step


@dataclass(frozen=True)
class Miss:
    """The worst prediction of a recording, what was asked, its gain [nat], and what is drawn."""

    recording: ObservedRecording
    observation: Observation
    question: Question
    gain: float
    sketch: Sketch


def observe_person(recordings: Sequence[Recording], config: Config) -> list[tuple[ObservedRecording, Miss | None]]:
    """Replay the recordings of a person in their order, and find the worst prediction of each, if any was asked for a way."""
    replayed = SketchingReplay(config)
    found = list[tuple[ObservedRecording, Miss | None]]()
    for recording in recordings:
        observed = observe(recording, config, replayed)
        found.append((observed, find_worst(observed, replayed.sketches)))
    return found


def find_worst(observed: ObservedRecording, sketches: dict[int, Sketch]) -> Miss | None:
    """Return the prediction in which the true way had the least log-likelihood above a uniform guess."""
    asked = ask_all(observed, PATH_CLASS)
    scored = [
        (float(np.log(PUBLISHED.forecast(each, question, None).true_probability(question) * question.possible)), number)
        for number, (each, question) in enumerate(asked)
    ]
    if not scored:
        return None
    gain, number = min(scored)
    observation, question = asked[number]
    return Miss(observed, observation, question, gain, sketches[observation.stamp_ns])


def tabulate_curve(before: Sequence[int], observed: Sequence[ObservedRecording]) -> Iterator[tuple[str, ...]]:
    """Yield the scores by number of movements before: movements, gain, error and NLPD of positions in the middle horizon."""
    for low, high in zip(CURVE, (*CURVE[1:], np.inf), strict=True):
        part = [each for number, each in zip(before, observed, strict=True) if low <= number < high]
        if part:
            positions = compute_position_scores(part)
            error, nlpd = positions['displacement_m']['most likely']['final'][MIDDLE], positions['nlpd']['foc'][MIDDLE]
            gain = format_ways(score_ways(part, PUBLISHED, [0] * len(part)))[0]
            yield f'{low}' if high <= low + 1 else f'from {low}', f'{len(part)}', gain, f'{1e3 * error:.0f}', f'{nlpd:.2f}'


def describe_miss(miss: Miss) -> tuple[str, ...]:
    """Return recording, progress [%], the probabilities of the true way and of the likeliest one [%], and the gain."""
    forecast = PUBLISHED.forecast(miss.observation, miss.question, None)
    values = 100 * miss.observation.truth.progress, 100 * forecast.true_probability(miss.question), 100 * forecast.confidence()
    return miss.recording.name, f'{values[0]:.0f}', f'{values[1]:.1f}', f'{values[2]:.0f}', f'{miss.gain:.2f}'


def draw_misses(misses: Sequence[Miss], name: str) -> None:
    """Draw the worst predictions: the path so far in grey, what came in black, and the likeliest candidates in colours."""
    with open_figure(2.2 * COLUMNS, 2.6 * -(-len(misses) // COLUMNS)) as figure:
        panels = figure.subplots(-(-len(misses) // COLUMNS), COLUMNS, squeeze=False).ravel()
        for panel in panels:
            panel.set_axis_off()
        for number, (panel, miss) in enumerate(zip(panels, misses, strict=False), 1):
            draw_miss(panel, miss)
            panel.set_title(f'{number}: {miss.recording.name}', fontsize=9)
        save_figure(figure, IMAGES / name)


def draw_miss(axes: Any, miss: Miss) -> None:
    """Draw one prediction."""
    path, stamp_ns = miss.recording.path, miss.observation.stamp_ns
    positions, is_past = path.positions[path.stamps_ns <= path.end_ns], path.stamps_ns[path.stamps_ns <= path.end_ns] <= stamp_ns
    low, high = positions.min(axis=0), positions.max(axis=0)
    centre, half = 0.5 * (low + high), 0.5 * float((high - low).max()) + 0.05
    bounds = centre[0] - half, centre[0] + half, centre[1] - half, centre[1] + half
    obstacles = miss.sketch.obstacles
    for row, (name, place) in enumerate(zip(obstacles.ids, obstacles.centre, strict=True)):
        axes.add_patch(make_obstacle_patch(obstacles, row, 0.0, facecolor='0.65', edgecolor='0.35', linewidth=0.8))
        if len(name) <= LONGEST_NAME:
            axes.text(*place, name, ha='center', va='center', fontsize=8)
    axes.plot(*miss.sketch.goals.T, '*', markersize=11, color='black', markerfacecolor='white')
    for slot, (likelihood, mean) in enumerate(sorted(miss.sketch.paths, key=lambda each: -each[0])[:SHOWN]):
        axes.plot(*mean.T, color=get_class_style(slot)[0], linewidth=1.0 + 3.0 * likelihood, label=f'{100 * likelihood:.0f} %')
    axes.plot(*positions[is_past].T, color='0.5', linewidth=1.5)
    axes.plot(*positions[~is_past].T, color='black', linewidth=1.5)
    axes.set(xlim=bounds[:2], ylim=bounds[2:], aspect='equal')
    axes.legend(fontsize=7, loc='upper center', bbox_to_anchor=(0.5, 0.0), ncols=SHOWN, handlelength=1.0, columnspacing=1.0)


def measure(data: str, config: Config, every: int, executor: Executor) -> tuple[list[ObservedRecording], list[Miss], list[int]]:
    """Replay data in order; return what was observed, the worst prediction of each, and the number of movements before each."""
    persons = {D3IL: list(find_recordings(SHARED / D3IL).values())} if data == D3IL else find_persons(SHARED / data)
    items = [(person, found[::every]) for person, found in persons.items()]
    seen = collect_all(partial(observe_person, config=config), items, executor, data)
    pairs = [pair for each in seen for pair in each]
    before = [number for each in seen for number in range(len(each))]
    return [observed for observed, _ in pairs], [miss for _, miss in pairs if miss is not None], before


def tabulate_halves(observed: Sequence[ObservedRecording]) -> Iterator[tuple[str, ...]]:
    """Yield the scores of both halves of D3IL: that on which settings were chosen, and the other one."""
    for half, held_out in (('chosen on', False), ('other', True)):
        part = [each for each in observed if is_held_out(each.name) == held_out]
        if not part:  # with --every
            continue
        yield half, *format_ways(score_ways(part, PUBLISHED, [0] * len(part))), *format_positions(part)[:2]


def show_worst(data: str, misses: Sequence[Miss]) -> list[tuple[str, ...]]:
    """Draw the worst predictions of recordings on which no setting was chosen, and return their rows."""
    held_out = [each for each in misses if data != D3IL or is_held_out(each.recording.name)]
    found = sorted(held_out, key=lambda each: each.gain)[:WORST]
    draw_misses(found, f'worst_{data}.png')
    return [(data, f'{number}', *describe_miss(each)) for number, each in enumerate(found, 1)]


def main() -> None:
    """Measure and write tables and pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--every', type=int, default=1, help='use every n-th recording of a person only')
    add_worker_arguments(parser)
    arguments = parser.parse_args()
    order, curves, worst = [], [], []
    with open_executor(arguments) as executor:
        for data, setting, learning in RUNS:
            config = SETTINGS[data, setting].with_values({'experience.learning': learning})
            observed, misses, before = measure(data, config, arguments.every, executor)
            title = setting if learning == 'none' else f'{setting}, scene learnt'
            curves += [(data, title, *row) for row in tabulate_curve(before, observed)]
            if data == D3IL:
                order += [(title, *row) for row in tabulate_halves(observed)]
            if setting == 'defaults' and learning == 'none':
                worst += show_worst(data, misses)
    gain, heads = 'gain [nat]', ('right [%]', 'ECE', 'worst tenth [nat]')
    curve = 'movements before', 'movements', gain, f'error at {MIDDLE} s [mm]', f'NLPD at {MIDDLE} s'
    misses_head = 'picture', 'recording', 'progress [%]', 'true way [%]', 'likeliest way [%]', gain
    write_blocks(
        {
            'order': format_table(('parameters', 'half', gain, *heads, 'error [mm]', 'NLPD'), order),
            'curves': format_table(('data', 'parameters', *curve), curves),
            'worst': format_table(('data', *misses_head), worst),
        },
        PAGE,
    )


if __name__ == '__main__':
    main()
