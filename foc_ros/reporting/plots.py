"""All pictures, made of what `drawing` puts on axes: a scene with the ways through it, a recording, a movement at one moment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from foc_ros.core.errors import InputError
from foc_ros.core.types import NANOSECONDS, Array, Obstacles, PredictedCandidate, Prediction, make_obstacles

from .drawing import (
    CLASSES,
    STDDEVS,
    STYLE,
    Bounds,
    draw_colour_bar,
    draw_hand,
    draw_legend,
    draw_likelihoods,
    draw_movement,
    draw_scene,
    draw_speeds,
    draw_ways,
    new_figure,
)
from .snapshots import CandidateView, Snapshot, Track, candidate_views

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_IN = 6.4
LINE_IN = 0.2
"""Height of a line of the legend [in]."""


def plot_outcomes(file: Path | str, obstacles: Obstacles, goals: Array, outcomes: Sequence[PredictedCandidate]) -> None:
    """Write a picture of the solved outcomes in their scene, in the format that the file's suffix says.

    goals (g, 2) [m]. Raises InputError where the file's suffix is no picture format or it cannot be written.
    """
    ways = candidate_views(outcomes)
    save(scene_figure(obstacles, goals, ways, bounds_of(obstacles, goals, ways)), file)


def plot_prediction(prediction: Prediction, axes: Any = None) -> Any:
    """Draw a prediction with its obstacles and goals.

    Parameters
    ----------
    prediction : Prediction
        Its solved candidates are drawn, coloured by likelihood, with ellipses of one standard deviation of the position.
    axes : matplotlib.axes.Axes, optional
        Where to draw; axes of a new pyplot figure by default.

    Returns
    -------
    matplotlib.axes.Axes
        The axes that hold the drawing.
    """
    import matplotlib.pyplot as plt

    candidates = candidate_views(prediction.solved_candidates)
    obstacles = getattr(prediction, 'obstacles', make_obstacles())
    goals = np.reshape(getattr(prediction, 'goals', ()), (-1, 2))
    bounds = bounds_of(obstacles, goals, candidates)
    with plt.rc_context(STYLE):
        if axes is None:
            axes = plt.figure(figsize=(WIDTH_IN, _scene_height(bounds) + 1.0), layout='constrained').subplots()
        draw_scene(axes, obstacles, goals, bounds)
        draw_ways(axes, candidates, _numbered([each.label for each in candidates]))
    return axes


def scene_figure(obstacles: Obstacles, goals: Array, ways: Sequence[CandidateView], bounds: Bounds) -> Figure:
    """Return a figure of one scene: obstacles, goals, ways coloured by likelihood; letters and a legend name them."""
    numbers = _numbered([way.label for way in ways])
    heights = [_scene_height(bounds), LINE_IN * max(1, len(ways))]
    with new_figure(WIDTH_IN, sum(heights) + 0.8) as figure:
        scene, legend = figure.subplots(2, 1, height_ratios=heights)
        draw_scene(scene, obstacles, goals, bounds)
        draw_ways(scene, ways, numbers)
        draw_colour_bar(figure, scene)
        draw_legend(legend, ways, numbers)
    return figure


def track_figure(track: Track, obstacles: Obstacles, goals: Array, spans: Sequence[tuple[int, int]], bounds: Bounds) -> Figure:
    """Return a figure of all movements of a recording, numbered; spans: start and end [ns] of each."""
    with new_figure(WIDTH_IN, _scene_height(bounds) + 0.6) as figure:
        axes = figure.subplots()
        draw_scene(axes, obstacles, goals, bounds, named=False)
        axes.plot(*track.positions.T, color='0.8', linewidth=0.8)
        for number, (start_ns, end_ns) in enumerate(spans):
            draw_movement(axes, track.positions[track.between(start_ns, end_ns)], number)
    return figure


@dataclass(frozen=True)
class Around:
    """The predictions of one movement; lines: number of the line of each way of each, by label; letters: number by line."""

    moments: tuple[Snapshot, ...]
    lines: tuple[Mapping[str, int], ...]
    letters: Mapping[int, int]


def moment_figure(track: Track, moment: Snapshot, around: Around, span: tuple[int, int], bounds: Bounds) -> Figure:
    """Return one movement at one moment: scene above, then likelihoods and speeds over the whole movement.

    around: the predictions during the movement, the moment among them; span: its start and end [ns].
    """
    place = [each.stamp_ns for each in around.moments].index(moment.stamp_ns)
    numbers = {label: around.letters[line] for label, line in around.lines[place].items() if line in around.letters}
    origin_ns = int(track.stamps_ns[0])
    now = (moment.stamp_ns - origin_ns) / NANOSECONDS
    heights = [_scene_height(bounds), LINE_IN * max(1, len(moment.ways)), 2.0, 1.6]
    with new_figure(WIDTH_IN, sum(heights) + 1.2) as figure:
        scene, legend, likelihoods, speeds = figure.subplots(4, 1, height_ratios=heights)
        draw_scene(scene, moment.obstacles, moment.goals, bounds)
        draw_ways(scene, moment.ways, numbers)
        draw_hand(scene, track, moment.stamp_ns, span)
        draw_colour_bar(figure, scene)
        draw_legend(legend, moment.ways, numbers)
        draw_likelihoods(likelihoods, around.moments, around.lines, around.letters, origin_ns)
        draw_speeds(speeds, track, moment, span, origin_ns)
        for axes in (likelihoods, speeds):
            axes.axvline(now, color='0.4', linewidth=1.0, linestyle=':')
            axes.set_xlim(*((stamp - origin_ns) / NANOSECONDS for stamp in span))
        scene.set_title(f'at {now:.2f} s')
    return figure


def bounds_of(obstacles: Obstacles, goals: Array, ways: Sequence[CandidateView], *points: Array) -> Bounds:
    """Return x and y limits [m] that hold obstacles, goals, ways with their ellipses, and other points (m, 2), with a margin."""
    reach = (obstacles.radius + STDDEVS * obstacles.radius_stddev)[:, None]
    spread = [(way.path, STDDEVS * np.sqrt(np.diagonal(way.covariance, axis1=1, axis2=2))) for way in ways]
    discs = [(obstacles.centre, reach), *spread]
    edges = [centre + sign * width for centre, width in discs for sign in (-1.0, 1.0)]
    everything = np.concatenate([*edges, np.reshape(goals, (-1, 2)), *points])
    low, high = (everything.min(axis=0), everything.max(axis=0)) if len(everything) else (np.zeros(2), np.ones(2))
    margin = 0.04 * max(*(high - low), 0.05)
    return float(low[0] - margin), float(high[0] + margin), float(low[1] - margin), float(high[1] + margin)


def save(figure: Figure, file: Path | str) -> None:
    """Write a figure in the format that the file's suffix says; InputError where that cannot be done."""
    known = figure.canvas.get_supported_filetypes()
    if Path(file).suffix.lower().removeprefix('.') not in known:
        raise InputError('picture file', f'a name that ends in {", ".join("." + each for each in sorted(known))}', str(file))
    try:
        # without its date, a PDF is the same file each time
        dateless = {'CreationDate': None} if Path(file).suffix.lower() == '.pdf' else None
        figure.savefig(file, bbox_inches='tight', pad_inches=0.08, metadata=dateless)
    except OSError as error:
        raise InputError('picture file', 'a file that can be written', f'{file}: {error.strerror or error}') from error


def _scene_height(bounds: Bounds) -> float:
    """Return the height [in] that a scene needs, with equal axes, beside its colour bar."""
    wide, high = bounds[1] - bounds[0], bounds[3] - bounds[2]
    return float(np.clip(0.8 * WIDTH_IN * high / wide, 2.0, 7.0))


def _numbered(labels: Sequence[str]) -> dict[str, int]:
    """Return the number of each class, which gives it letter and colour; those beyond the number of classes get none."""
    return {label: number for number, label in enumerate(labels[:CLASSES])}
