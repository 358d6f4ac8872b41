"""Pictures: the drawn values are the computed ones, in colours that can be told apart with any colour vision."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from matplotlib import pyplot as plt
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Polygon
from report_samples import START_NS, prediction, predictions, samples, scene

from foc_ros.core.errors import InputError
from foc_ros.core.obstacles import shapes
from foc_ros.core.obstacles.geometry import measure_offsets, trace_obstacle
from foc_ros.core.types import Status, make_obstacles
from foc_ros.reporting.drawing import (
    CLASS_COLOURS,
    CLASSES,
    ELLIPSES_PER_CANDIDATE,
    NO_CLASS_COLOUR,
    get_candidate_style,
    get_class_style,
    make_stddev_ellipse,
)
from foc_ros.reporting.plots import (
    compute_bounds,
    draw_likelihoods,
    make_scene_figure,
    make_snapshot_figure,
    plot_outcomes,
    plot_prediction,
    save_figure,
)
from foc_ros.reporting.snapshots import build_candidate_views, build_hand_trajectory, build_snapshot, build_unsolved_views
from foc_ros.reporting.track_association import build_candidate_tracks
from foc_ros.ros.messages.ranking import find_drawn_curve

ROOT = Path(__file__).resolve().parents[1]
WALL = shapes.Box((0.1, 0.0), (0.6, 0.02), 0.3, radius_stddev=0.01)
PNG = b'\x89PNG\r\n\x1a\n'


@pytest.mark.parametrize('seed', range(5))
def test_ellipse_is_the_level_set_of_the_covariance(seed: int) -> None:
    root = np.random.default_rng(seed).normal(size=(2, 2))
    covariance, centre = root @ root.T, np.array([0.3, -0.1])
    ellipse = make_stddev_ellipse(centre, covariance, 2.0)
    edge = ellipse.get_patch_transform().transform(np.array([[1.0, 0.0], [0.0, 1.0], [-0.6, 0.8]])) - centre
    np.testing.assert_allclose(np.einsum('ki,ij,kj->k', edge, np.linalg.inv(covariance), edge), 4.0, rtol=1e-9)


def test_ellipse_of_no_uncertainty_is_a_point() -> None:
    ellipse = make_stddev_ellipse(np.zeros(2), np.array([[0.0, 0.0], [0.0, -1e-18]]))
    assert (ellipse.width, ellipse.height) == (0.0, 0.0)


def luminance(colour: tuple[float, float, float]) -> float:
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


def test_colours_show_on_white_and_the_likely_candidate_is_the_thickest() -> None:
    assert all(1.05 / (luminance(colour) + 0.05) > 1.5 for colour in (*CLASS_COLOURS, NO_CLASS_COLOUR))
    widths = [get_candidate_style(0, likelihood)['linewidth'] for likelihood in np.linspace(0.0, 1.0, 20)]
    assert np.all(np.diff(widths) > 0.0)
    styles = [get_class_style(slot) for slot in range(CLASSES)]
    assert len(set(styles)) == CLASSES


def test_class_colours_differ_for_the_colour_blind() -> None:
    """The colours differ as seen by a deuteranope and a protanope (Vienot, Brettel, Mollon 1999, linear RGB)."""
    deuteranope = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])
    protanope = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
    linear = np.array([to_rgb(colour) for colour in CLASS_COLOURS]) ** 2.2
    for seen in (np.clip(linear @ matrix.T, 0.0, 1.0) ** (1 / 2.2) for matrix in (deuteranope, protanope)):
        gaps = np.linalg.norm(seen[:, None] - seen[None], axis=2)[np.triu_indices(len(seen), 1)]
        assert gaps.min() > 0.1


def test_scene_holds_every_obstacle_goal_and_candidate() -> None:
    obstacles, goals = scene()
    candidates = build_candidate_views(prediction(START_NS, np.zeros(2)).candidates)
    axes = make_scene_figure(obstacles, goals, candidates).axes[0]
    radii = sorted(patch.radius for patch in axes.patches if isinstance(patch, Circle))
    np.testing.assert_allclose(radii, [0.02, 0.02, 0.03, 0.033])
    drawn = [line.get_xydata() for line in axes.lines]
    for each in candidates:
        assert any(np.array_equal(line, each.curve) for line in drawn)
    for goal in goals:
        assert any(np.array_equal(line, [goal]) for line in drawn)
    assert sum(type(patch) is Ellipse for patch in axes.patches) == ELLIPSES_PER_CANDIDATE * len(candidates)


def test_boxes_are_drawn_with_their_outlines_and_fit_into_the_picture() -> None:
    obstacles, goals = shapes.collect_obstacles([WALL, shapes.Circle((0.2, 0.1), 0.02)]), scene()[1]
    axes = make_scene_figure(obstacles, goals, ()).axes[0]
    ring, box = (patch.get_xy() for patch in axes.patches if isinstance(patch, Polygon))
    np.testing.assert_allclose(box, trace_obstacle(obstacles, 0))
    np.testing.assert_allclose(measure_offsets(ring, obstacles)[1][:, 0], 0.01)
    assert sum(isinstance(patch, Circle) for patch in axes.patches) == 2
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert left < ring[:, 0].min() and ring[:, 0].max() < right and bottom < ring[:, 1].min() and ring[:, 1].max() < top


def legend_of(axes: Any) -> str:
    """Return the text of the legend without its line breaks."""
    return ' '.join(' '.join(each.get_text().split()) for each in axes.get_legend().get_texts())


def test_candidates_without_a_likelihood_are_grey_with_reason_and_remedy() -> None:
    made = prediction(START_NS, np.zeros(2))
    axes = plot_prediction(made, Figure().subplots())
    lost = made.candidates[-1]
    (grey,) = [line for line in axes.lines if line.get_color() == NO_CLASS_COLOUR]
    np.testing.assert_allclose(grey.get_xydata()[[0, -1]], lost.solution.path[[0, -1]], atol=1e-12)
    assert f'- % {lost.label} {lost.description}; {lost.reason}' in legend_of(axes)
    assert lost.status.remedy in legend_of(axes)


def test_a_failed_scene_shows_the_attempt_and_the_start() -> None:
    obstacles, goals = scene()
    made = prediction(START_NS, np.zeros(2))
    lost, start = build_unsolved_views(made.candidates), np.array([[-0.1, 0.02]])
    axes = make_scene_figure(obstacles, goals, (), lost, start).axes[0]
    assert any(np.array_equal(line.get_xydata(), start) for line in axes.lines)
    assert any(np.array_equal(line.get_xydata(), lost[0].path) for line in axes.lines)
    assert axes.get_xlim()[0] < -0.1


def test_both_ellipses_are_drawn_and_named_and_a_compromised_candidate_is_dotted() -> None:
    obstacles, goals = scene()
    made = prediction(START_NS, np.zeros(2))
    (first, *rest), wide = made.candidates, 4.0 * made.candidates[0].solution.covariance
    changed = replace(first, solution=replace(first.solution, status=Status.COMPROMISED).with_covariance(wide))
    axes = make_scene_figure(obstacles, goals, build_candidate_views([changed, *rest])).axes[0]
    ellipses = [patch for patch in axes.patches if type(patch) is Ellipse]
    dashed = [each for each in ellipses if each.get_linestyle() == '--']
    assert len(dashed) == ELLIPSES_PER_CANDIDATE
    assert len(ellipses) == 4 * ELLIPSES_PER_CANDIDATE
    np.testing.assert_allclose(max(each.width for each in dashed), 2 * 2 * 0.011)
    text = legend_of(axes)
    assert 'motor noise, which eta is about' in text and 'total uncertainty' in text
    assert text.count('compromised: eta 0.900') == 1
    assert [line.get_linestyle() for line in axes.lines if line.get_label().strip().startswith('A')] == [':']


def test_the_unknown_share_is_hatched() -> None:
    made = predictions(samples())
    lost = [replace(each, candidates=each.candidates[-1:], most_likely=None, unknown=1.0) for each in made[20:]]
    axes = Figure().subplots()
    draw_likelihoods(axes, build_candidate_tracks([build_snapshot(each) for each in (*made[:20], *lost)]), START_NS)
    (hatched,) = axes.collections
    assert hatched.get_hatch()
    corners = hatched.get_paths()[0].vertices
    for stamp_ns, lowest in ((made[10].stamp_ns, 0.75), (made[30].stamp_ns, 0.0)):
        near = np.abs(corners[:, 0] - (stamp_ns - START_NS) * 1e-9) < 0.03
        assert corners[near, 1].min() == lowest


def test_bounds_hold_the_ellipses() -> None:
    obstacles, goals = scene()
    candidates = build_candidate_views(prediction(START_NS, np.zeros(2)).candidates)
    left, right, bottom, top = compute_bounds(obstacles, goals, candidates)
    assert right > 0.3 + 2 * 0.011
    assert left < 0.0
    assert bottom < -0.06
    assert top > 0.12


def test_a_snapshot_figure_shows_past_and_future_of_the_hand() -> None:
    made = samples()
    hand = build_hand_trajectory(made)
    (span,) = hand.find_movements(0.05)
    during = [build_snapshot(each) for each in predictions(made) if span[0] <= each.stamp_ns <= span[1]]
    row = len(during) // 3
    snapshot = during[row]
    bounds = compute_bounds(*scene(), snapshot.candidates)
    figure = make_snapshot_figure(hand, build_candidate_tracks(during), row, span, bounds)
    drawn = [line for line in figure.axes[0].lines if line.get_color() == 'black' and len(line.get_xdata()) > 1]
    assert [line.get_linestyle() for line in drawn] == ['-', ':']
    now = hand.positions[hand.stamps_ns == snapshot.stamp_ns][0]
    np.testing.assert_array_equal(drawn[0].get_xydata()[-1], now)
    likelihoods = [line.get_ydata() for line in figure.axes[1].lines if len(line.get_ydata()) == len(during)]
    expected = sorted(each.likelihood for each in snapshot.candidates)
    np.testing.assert_array_equal(sorted(values[row] for values in likelihoods), expected)


@pytest.mark.parametrize('suffix', ['png', 'pdf', 'svg'])
def test_plot_outcomes(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f'scene.{suffix}'
    plot_outcomes(file, *scene(), prediction(START_NS, np.zeros(2)).candidates, np.zeros(2))
    start = {'png': PNG, 'pdf': b'%PDF', 'svg': b'<?xml'}[suffix]
    assert file.read_bytes().startswith(start)


def test_plot_without_a_solution_or_an_obstacle(tmp_path: Path) -> None:
    outcomes = [each for each in prediction(START_NS, np.zeros(2)).candidates if not each.is_solved]
    plot_outcomes(tmp_path / 'none.png', make_obstacles(), scene()[1], outcomes, np.zeros(2))
    assert (tmp_path / 'none.png').read_bytes().startswith(PNG)


@pytest.mark.parametrize(
    ('name', 'expected'), [('scene.xyz', r'\.png'), ('scene', r'\.png'), ('no/such/scene.png', 'can be written')]
)
def test_a_file_that_cannot_be_written(tmp_path: Path, name: str, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        plot_outcomes(tmp_path / name, *scene(), prediction(START_NS, np.zeros(2)).candidates, np.zeros(2))
    assert list(tmp_path.iterdir()) == []


def test_equal_input_gives_equal_pictures(tmp_path: Path) -> None:
    obstacles, goals = scene()
    candidates = build_candidate_views(prediction(START_NS, np.zeros(2)).candidates)
    for name in ('one.png', 'two.png'):
        save_figure(make_scene_figure(obstacles, goals, candidates), tmp_path / name)
    assert (tmp_path / 'one.png').read_bytes() == (tmp_path / 'two.png').read_bytes()


@pytest.mark.parametrize(
    ('missing', 'module'), [('matplotlib', 'plots'), ('matplotlib', 'report'), ('plotly', 'report'), ('jinja2', 'report')]
)
def test_a_missing_library_is_reported_in_one_line_with_how_to_install_it(missing: str, module: str) -> None:
    program = f"""
import importlib.util, sys
sys.modules['{missing}'] = None
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == '{missing}' else find_spec(name, *rest)
from foc_ros.core.errors import FocError
try:
    import foc_ros.reporting.{module}
except FocError as error:
    print(error)
"""
    printed = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert 'pip install' in printed
    assert printed.count('\n') == 1


def test_a_prediction_is_drawn_on_given_or_new_axes() -> None:
    made = prediction(START_NS, np.zeros(2))
    given = Figure().subplots()
    assert plot_prediction(made, given) is given
    for axes in (given, plot_prediction(made)):
        drawn = [line.get_xydata() for line in axes.lines]
        assert all(any(np.array_equal(line, find_drawn_curve(each)) for line in drawn) for each in made.solved_candidates)
    plt.close('all')
