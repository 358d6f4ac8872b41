#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Make the pictures of README and doc/, all of which the program computes.

python scripts/pictures.py [NAME ...], with NAME of scene, demo, api, play, concept_noise, concept_surrogate,
concept_strategies, concept_classes, concept_likelihood, contacts. `play` needs Chromium, its driver and selenium, `demo` Pillow.
"""

from __future__ import annotations

import argparse
import io
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from runpy import run_path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from page import IMAGES, ROOT

import foc_ros
from foc_ros.analysis.replay import Replay
from foc_ros.analysis.solve import solve_to_values
from foc_ros.core.classes.guess import guess_path
from foc_ros.core.config import Config, LikelihoodConfig
from foc_ros.core.interpolation import interpolate_position
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.io.bags import BagReader
from foc_ros.io.scene_file import load_scene
from foc_ros.reporting import draw
from foc_ros.reporting.draw import compute_bounds, draw_scene, get_class_style, open_figure, save_figure
from foc_ros.reporting.figures import make_moment_figure, make_scene_figure
from foc_ros.reporting.report import ReportCollector
from foc_ros.reporting.views import CandidateTracks, HandTrajectory, build_candidate_tracks, build_hand_trajectory, build_snapshot
from foc_ros.ros.parameters import dump_parameter_file

sys.path.append(str(ROOT / 'test'))

RECORDING, SCENE = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap', ROOT / 'doc' / 'examples' / 'scene.yaml'
MOVEMENT, AFTER_S = 5, 0.14
"""The movement, counted from 1, and the time after its beginning [s] of the scene: early, with several candidates."""
SHOWN_MOVEMENTS = (0, 4, 6)
"""Rows of the movements of the recording that the animation shows."""
PICTURES, LAST_MS, STEP_MS, COLOURS, SHOWN = 18, 1200, 140, 128, 0.02
"""Pictures of a movement, durations of the last and of each other picture [ms], about a third of the real speed; colours; least
likelihood of a path that the animation shows."""
STEPS, GOAL = 50, np.array([0.3, 0.0])
SLANTED = np.array([0.3, 0.12])
"""A goal that needs effort on both axes."""
TOUCHED, TOUCHED_ETA, TOUCHED_NOISE = foc_ros.Circle((0.12, 0.0), radius=0.03, radius_stddev=0.003), 0.89, 0.15
"""The scene of the contacts."""
ETAS = np.linspace(0.8, 0.95, 61)
CURVE = np.arange(0.0, 27.0, 0.1)
"""Points s of the curve with rows at the steps."""


@cache
def replayed() -> tuple[HandTrajectory, list[Prediction]]:
    """Return the hand's trajectory and all predictions of the recording."""
    collected = ReportCollector()
    with BagReader(RECORDING) as reader:
        for step in Replay(Config()).steps(reader):
            collected.add(step)
    return build_hand_trajectory(collected.samples), collected.snapshots


def scene(hand: HandTrajectory, snapshots: list[Prediction]) -> Figure:
    """Return the picture of the chosen prediction."""
    span = hand.find_movements()[MOVEMENT - 1]
    wanted_ns = span[0] + int(AFTER_S * NANOSECONDS)
    snapshot = min(snapshots, key=lambda each: abs(each.stamp_ns - wanted_ns))
    return make_moment_figure(hand, snapshot, span)


def pictures(hand: HandTrajectory, snapshots: list[Prediction]) -> Iterator[tuple[Figure, int]]:
    """Yield the pictures, each with its duration [ms]."""
    spans = hand.find_movements()
    goals = np.unique(np.concatenate([each.goal_positions for each in snapshots]), axis=0)
    bounds = compute_bounds(snapshots[0].obstacles, goals, (), hand.positions)
    for start_ns, end_ns in (spans[number] for number in SHOWN_MOVEMENTS):
        during = [each for each in snapshots if start_ns <= each.stamp_ns <= end_ns and each.candidates_with_likelihood]
        tracks = build_candidate_tracks([select_likely(each) for each in during])
        rows = np.unique(np.linspace(0, len(tracks.snapshots) - 1, PICTURES).round().astype(int))
        for row in rows:
            snapshot = tracks.snapshots[row]
            with open_figure(8.4, 4.5) as figure:
                scene, shares = figure.subplots(1, 2, width_ratios=(1.55, 1.0))
                scene.grid(False)
                draw_scene(scene, snapshot.obstacles, snapshot.goal_positions, bounds)
                slots = {label: tracks.slots[track] for label, track in tracks.tracks[row].items() if track in tracks.slots}
                draw.draw_candidates(scene, snapshot, slots)
                draw.draw_hand(scene, hand, snapshot.stamp_ns, (start_ns, end_ns))
                draw.draw_letters(scene, snapshot, slots)
                until_now = CandidateTracks(tracks.snapshots[: row + 1], tracks.tracks[: row + 1], tracks.slots)
                draw_likelihoods(shares, until_now, start_ns)
                limits = (0.0, (end_ns - start_ns) / NANOSECONDS)
                shares.set(xlim=limits, ylim=(-0.03, 1.03), xlabel='time [s]', title='likelihood of each candidate')
                figure.legend(*zip(*make_signs(), strict=True), loc='outside lower center', ncols=5, frameon=False, fontsize=9)
            yield figure, STEP_MS if row != rows[-1] else LAST_MS


def draw_likelihoods(axes: Any, tracks: CandidateTracks, origin_ns: int) -> None:
    """Draw the likelihoods of the tracks that have a slot over time [s]; the share that no candidate has is hatched."""
    times = (np.array([each.stamp_ns for each in tracks.snapshots]) - origin_ns) / NANOSECONDS
    drawn = {track: values for track, values in tracks.likelihoods().items() if track in tracks.slots}
    for rank, (track, (first, values)) in enumerate(drawn.items()):
        colour = draw.CLASS_COLOURS[tracks.slots[track]]
        axes.plot(times[first : first + len(values)], values, color=colour, linewidth=1.8, marker='.', markersize=2.5)
        known = np.flatnonzero(np.isfinite(values))
        row = known[(2 * rank + 1) * len(known) // (2 * len(drawn))]
        draw.draw_tag(axes, (times[first + row], values[row]), draw.get_letter(tracks.slots[track]), colour)
    unknown = np.array([each.unknown + each.other for each in tracks.snapshots])
    look = {'facecolor': 'none', 'edgecolor': '0.6', 'hatch': '////', 'linewidth': 0.0, 'step': 'mid'}
    axes.fill_between(times, 1.0 - unknown, 1.0, **look)


def select_likely(snapshot: Prediction) -> Prediction:
    """Return a snapshot with the candidates that the animation shows; ghosts without a likelihood stay."""
    shown = tuple(each for each in snapshot if each.likelihood >= SHOWN or not each.has_likelihood)
    return replace(snapshot, candidates=shown)


def make_signs() -> list[tuple[Any, str]]:
    """Return what the signs of the animation mean: of each an example, and words."""
    colour, _ = get_class_style(0)
    return [
        (Line2D([], [], marker='o', color='black', linestyle=''), 'hand'),
        (Line2D([], [], color='black', linewidth=2.0), 'hand before'),
        (Line2D([], [], color='0.55', linewidth=1.4), 'hand later'),
        (Line2D([], [], marker='*', markersize=12, color='black', markerfacecolor='white', linestyle=''), 'goal'),
        (Line2D([], [], color=colour, linewidth=3.0), 'predicted path'),
        (Line2D([], [], color=colour, linestyle=':', linewidth=2.0), 'less surely clear'),
        (Patch(facecolor=to_rgba(colour, 0.3), edgecolor=colour), 'its motor noise'),
        (Patch(fill=False, edgecolor=colour, linestyle='--'), 'all uncertainty'),
        (Patch(facecolor='0.65', edgecolor='0.35'), 'obstacle'),
        (Patch(facecolor='none', edgecolor='0.6', hatch='////', linewidth=0.0), 'unknown'),
    ]


def save_animation(drawn: list[tuple[Figure, int]], file: Path) -> None:
    """Write an animated GIF."""
    from PIL import Image

    images = []
    for figure, _ in drawn:
        buffer = io.BytesIO()
        figure.savefig(buffer, format='png', dpi=96)
        images.append(Image.open(buffer).convert('RGB'))
    # a strip in each colour of the paths keeps them apart in the palette, too
    strips = [Image.new('RGB', (images[0].width, 60), colour) for colour in draw.CLASS_COLOURS]
    every, top = Image.new('RGB', (images[0].width, sum(each.height for each in (*images, *strips)))), 0
    for image in (*images, *strips):
        every.paste(image, (0, top))
        top += image.height
    palette = every.quantize(COLOURS, dither=Image.Dither.NONE)  # one for all, so that what stays the same takes no room
    first, *others = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    durations = [duration_ms for _, duration_ms in drawn]
    first.save(file, save_all=True, append_images=others, duration=durations, loop=0, optimize=True)


def api() -> Figure:
    """Return the figure that the Python code of the README draws."""
    found = re.search(r'^```python\n(.*?)^```', (ROOT / 'README.md').read_text('utf-8'), re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError('README.md shows no Python code')
    names = dict[str, object]()
    exec(compile(found.group(1), 'README.md', 'exec'), names)
    axes: Any = names['axes']
    figure: Figure = axes.figure
    return figure


def play_page() -> bytes:
    """Return the page of `foc_ros play` in a headless Chromium, with a hand on its way, as a PNG file."""
    from browser_helpers import chromium, screenshot  # type: ignore[import-not-found]
    from play_helpers import play, steer, visit, wait_for_answer  # type: ignore[import-not-found]

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / 'foc.yaml'
        file.write_text(dump_parameter_file(Config(budget_s=0.0)), encoding='utf-8')
        with play(folder, '--params', str(file)) as started, chromium(folder / 'profile') as browser:
            visit(browser, started, 1100, 860)
            # there and back: the first predictions take longer
            steer(browser, (0.0, 0.0), (0.06, -0.012), (0.0, 0.0), speed=0.02)
            steer(browser, (0.06, -0.012), speed=0.15)
            wait_for_answer(browser)
            picture: bytes = screenshot(browser)
    return picture


def reach(strategy: str, eta: float, **penalties: float) -> foc_ros.Solution:
    """Return a reach from rest to rest past the obstacle of the contacts, on its left."""
    values = {'foc.noise_x': TOUCHED_NOISE, 'foc.noise_y': TOUCHED_NOISE, 'likelihood.shortfall': np.inf}
    config = Config().with_values(values | {f'foc.{name}': value for name, value in penalties.items()})
    guess = guess_path(np.zeros(2), GOAL, STEPS, 0.05)
    return foc_ros.solve((0.0, 0.0), GOAL, [TOUCHED], eta, strategy, config=config, guess=guess)


def roll_out(solution: foc_ros.Solution, count: int) -> list[Array]:
    """Return noisy movements under the control of a solution, (N, 2) [m] each."""
    control, problem = solution.control.T.ravel(), solution.problem
    assert problem is not None
    draws = np.random.default_rng(0).standard_normal((count, control.size))
    return [problem.positions(control + problem.noise[0] * np.abs(control) * each) for each in draws]


def noise() -> Figure:
    """Return the picture of a quick and a slow reach: noise grows with effort."""
    with open_figure(8.6, 3.4) as figure:
        paths, spread = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
        for number, (seconds, shift) in enumerate(((0.5, 0.05), (1.2, -0.05))):
            colour, _ = get_class_style(number)
            solution = foc_ros.solve((0.0, 0.0), SLANTED, duration_s=seconds)
            up = np.array([0.0, shift])
            for movement in roll_out(solution, 30):
                paths.plot(*(movement + up).T, color=colour, linewidth=0.5, alpha=0.35)
            paths.plot(*(solution.path + up).T, color=colour, linewidth=2.2)
            for row in range(3, len(solution.path), 3):
                ellipse = draw.make_stddev_ellipse(solution.path[row] + up, solution.covariance[row, :2, :2])
                ellipse.set(facecolor='none', edgecolor=colour, linewidth=0.9, alpha=0.8, zorder=3)
                paths.add_patch(ellipse)
            paths.annotate(f'in {seconds:g} s', (0.0, shift), xytext=(-4, 16), textcoords='offset points', color=colour)
            deviation = 1e3 * np.sqrt(solution.covariance[:, 0, 0])
            spread.plot(solution.times, deviation, color=colour, linewidth=2.2, label=f'in {seconds:g} s')
        paths.set(xlabel='x [m]', ylabel='y [m]')
        paths.set_aspect('equal', adjustable='datalim')
        spread.set(xlabel='time [s]', ylabel='standard deviation of x [mm]', ylim=(0.0, None))
        spread.legend(frameon=False)
    return figure


def draw_example(name: str) -> Figure:
    """Return the figure of a file in examples/, in the common style."""
    with mpl.rc_context(draw.STYLE):
        figure: Figure = run_path(str(ROOT / 'examples' / f'plot_{name}.py'))['figure']
    return figure


def classes() -> Figure:
    """Return the solved candidates of the scene of the examples."""
    return make_scene_figure(build_snapshot(solve_to_values(load_scene(SCENE), None)[0]))


def likelihood() -> Figure:
    """Return the picture of likelihoods over cost ratios for three values of beta."""
    costs = np.array([1.0, 1.3, 2.0, 4.0])
    with open_figure(8.6, 3.2) as figure:
        shares, pair = figure.subplots(1, 2)
        for number, beta in enumerate((0.5, 1.0, 2.0)):
            colour, dash = get_class_style(number)
            config = LikelihoodConfig(beta=beta)
            places = np.arange(len(costs)) + 0.27 * (number - 1)
            shares.bar(places, compute_likelihoods(costs, config), 0.25, color=colour, label=f'β = {beta:g}')
            ratios = np.geomspace(1.0, 10.0, 60)
            first = [compute_likelihoods(np.array([1.0, ratio]), config)[0] for ratio in ratios]
            pair.plot(ratios, first, color=colour, linestyle=dash, linewidth=2.0)
            draw.draw_tag(pair, (ratios[40], first[40]), f'{beta:g}', colour)
        shares.set_xticks(range(len(costs)), [f'{cost:g}' for cost in costs])
        shares.set(xlabel='cost of a candidate relative to the cheapest', ylabel='likelihood')
        shares.legend(frameon=False)
        pair.set(xscale='log', xlabel='cost ratio of two candidates', ylabel='likelihood of the cheaper one', ylim=(0.48, 1.02))
        pair.set_xticks([1, 2, 5, 10], ['1', '2', '5', '10'])
        pair.minorticks_off()
    return figure


def follow_with_rows_at_steps() -> Array:
    """Return eta and effort (m, 2) along the curve of `lv` where the constraint holds at the steps only, as in `fixed`."""
    foc, found = Config().foc, []
    for s in CURVE:
        solution = reach('fixed', TOUCHED_ETA, tau=foc.lv_delta * s, lam=foc.growth**s)
        if solution.status is not foc_ros.Status.SOLVED:
            break
        found.append((solution.eta, solution.effort))
    return np.array(found)


def contacts() -> Figure:
    """Return the picture: the mean against the circle, near the contact; effort over eta."""
    solution = reach('lv', TOUCHED_ETA)
    _, time, multiplier = max(solution.multipliers, key=lambda contact: contact[2])
    kept = float(np.sqrt(TOUCHED.radius**2 + TOUCHED.radius_stddev**2 + solution.tau))
    centre: Any = TOUCHED.centre
    blue, orange = get_class_style(0)[0], get_class_style(1)[0]
    fine = interpolate_position(solution.mean, solution.dt, solution.dt * np.linspace(0.0, STEPS, 20 * STEPS + 1))
    contact = interpolate_position(solution.mean, solution.dt, np.array([solution.dt * time]))[0]
    outward = 0.008 * (contact - centre) / np.linalg.norm(contact - centre)
    with open_figure(9.0, 3.6) as figure:
        touch, curves = figure.subplots(1, 2)
        touch.add_patch(Circle(centre, kept, facecolor='none', edgecolor='0.4', linestyle='--'))
        touch.plot(*fine.T, color=blue, linewidth=1.6)
        touch.plot(*solution.path.T, color=blue, marker='o', markersize=3.5, linestyle='none')
        touch.plot(*contact, color=orange, marker='D', markersize=7, zorder=5)
        arrow = {'arrowstyle': '<-', 'color': orange, 'linewidth': 1.8}
        words = f's = {time:.2f}, y = {multiplier:,.0f} m/s⁶'
        touch.annotate(words, contact, contact + outward, color=orange, fontsize=8, ha='center', arrowprops=arrow)
        for step in (int(time), int(time) + 1):
            look = {'xytext': (0, -14), 'textcoords': 'offset points', 'fontsize': 8, 'ha': 'center'}
            touch.annotate(f'step {step}', solution.path[step], **look)
        touch.set(title='The mean touches the circle between two steps', xlabel='x [m]', ylabel='y [m]')
        touch.set_aspect('equal')
        touch.set(xlim=contact[0] + 0.02 * np.array([-1, 1]), ylim=contact[1] + 0.012 * np.array([-1, 1]))
        along = follow_with_rows_at_steps()
        look = {'color': orange, 'marker': '.', 'markersize': 3, 'linestyle': 'none'}
        curves.plot(*along[along[:, 0] > ETAS[0]].T, label='rows at the steps', **look)
        sliding = [reach('lv', float(eta)).effort for eta in ETAS]
        curves.plot(ETAS, sliding, color=blue, linewidth=1.8, label='sliding contacts (lv)')
        curves.set(title='Effort over η', xlabel='η', ylabel='effort [m²/s⁶]', yscale='log', xlim=(ETAS[0], ETAS[-1]))
        curves.set_yticks([5e3, 1e4, 2e4, 4e4], ['5 000', '10 000', '20 000', '40 000'])
        curves.minorticks_off()
        curves.legend(fontsize=8, loc='upper left')
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    'scene': lambda: scene(*replayed()),
    'api': api,
    **{f'concept_{each.__name__}': each for each in (noise, classes, likelihood)},
    'concept_surrogate': lambda: draw_example('07_monte_carlo'),
    'concept_strategies': lambda: draw_example('04_strategies'),
    'contacts': contacts,
}


def main() -> None:
    """Make the pictures of the command line."""
    mpl.use('Agg')
    names = [*FIGURES, 'demo', 'play']
    parser = argparse.ArgumentParser(description='Make the pictures of README and doc/.')
    parser.add_argument('names', nargs='*', metavar='NAME', help=f'some of {", ".join(names)}; all if none is named')
    chosen = parser.parse_args().names or names
    if unknown := set(chosen) - set(names):
        parser.error(f'no picture is named {", ".join(sorted(unknown))}')
    for name in chosen:
        if name == 'demo':
            save_animation(list(pictures(*replayed())), IMAGES / 'demo.gif')
        elif name == 'play':
            (IMAGES / 'play.png').write_bytes(play_page())
        else:
            save_figure(FIGURES[name](), IMAGES / f'{name}.png')


if __name__ == '__main__':
    main()
