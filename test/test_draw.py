# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pictures for print: what is drawn is what was computed, and it can be told apart, read and placed anywhere."""

from dataclasses import replace
from importlib.resources import files
from itertools import combinations, islice, pairwise

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from matplotlib import pyplot as plt
from matplotlib.legend import Legend
from matplotlib.patches import Circle, Ellipse
from report_samples import START_NS, prediction, widen

from foc_ros import Config, replay
from foc_ros.core.errors import FocWarning
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.solution import LEFT, RIGHT, Status
from foc_ros.reporting.draw import GHOST_COLOUR, get_candidate_style
from foc_ros.reporting.figures import make_scene_figure, plot_prediction, write_picture
from foc_ros.reporting.views import build_snapshot
from foc_ros.ros.messages.ranking import find_drawn_curve

PNG = b'\x89PNG\r\n\x1a\n'
NOWHERE = np.zeros(2)


def test_the_likely_candidate_is_the_thickest_and_a_compromised_one_alone_is_dotted_and_says_its_eta():
    widths = [get_candidate_style(0, likelihood)['linewidth'] for likelihood in np.linspace(0.0, 1.0, 20)]
    assert np.all(np.diff(widths) > 0.0)
    assert {get_candidate_style(slot, 0.5)['linestyle'] for slot in (None, 0, 5, 9)} == {'-'}
    assert get_candidate_style(0, 0.5, is_compromised=True)['linestyle'] == ':'
    made = prediction(START_NS, NOWHERE)
    (first, *rest) = made.candidates
    changed = replace(first, solution=replace(first.solution, status=Status.COMPROMISED))
    axes = axes_of(replace(made, candidates=(changed, *rest)))
    assert legend_of(axes).count('less sure than wanted: eta 0.900') == 1
    assert 'dotted: not known to avoid' in legend_of(axes) and 'dotted' not in legend_of(axes_of(made))
    assert [line.get_linestyle() for line in axes.lines if line.get_label().startswith('A')] == [':']
    for status in (Status.DEADLINE, Status.ESTIMATED):
        unfinished = replace(first, solution=replace(first.solution, status=status))
        words = legend_of(axes_of(replace(made, candidates=(unfinished, *rest))))
        assert words.count('estimated: eta about 0.900') == 1 and 'less sure' not in words


def axes_of(made):
    return make_scene_figure(build_snapshot(made)).axes[0]


def legends_of(axes):
    """Return the legends below axes: of the candidates, and of the signs."""
    (below,) = [each for each in axes.figure.axes if each.get_gid() == f'legend {id(axes)}']
    return [each for each in below.get_children() if isinstance(each, Legend)]


def legend_of(axes):
    """Return the text of the legend without its line breaks."""
    texts = [text.get_text() for each in legends_of(axes) for text in each.get_texts()]
    return ' '.join(' '.join(each.split()) for each in texts)


def test_a_scene_holds_every_obstacle_goal_and_candidate():
    made = prediction(START_NS, NOWHERE)
    axes = axes_of(made)
    radii = sorted(patch.radius for patch in axes.patches if isinstance(patch, Circle))
    np.testing.assert_allclose(radii, [0.02, 0.03, 0.033], err_msg='a ring where the radius is uncertain only')
    drawn = [line.get_xydata() for line in axes.lines]
    for points in (*map(find_drawn_curve, build_snapshot(made).candidates_with_likelihood), *made.goal_positions[:, None]):
        assert any(np.array_equal(line, points) for line in drawn)


def test_a_legend_says_what_has_no_path_and_where_a_hand_is_that_is_inside_an_obstacle():
    made = replace(prediction(START_NS, NOWHERE), unknown=0.04, other=0.03)
    assert '7 % another class, or another goal' in legend_of(axes_of(made))
    assert 'another' not in legend_of(axes_of(replace(made, unknown=0.0, other=0.0)))
    around = make_obstacles([build_snapshot(made).candidates[0].solution.path[0]], 0.01, ids=('cup',))
    titles = [each.get_title().get_text() for each in legends_of(axes_of(replace(made, obstacles=around)))]
    assert 'the hand is inside obstacle cup' in titles


def test_a_moving_obstacle_is_outlined_where_it_is_later():
    made = prediction(START_NS, NOWHERE)
    moving = replace(made.obstacles, velocity=np.array([[0.0, 0.05]] + [[0.0, 0.0]] * (len(made.obstacles) - 1)))
    axes = axes_of(replace(made, obstacles=moving))
    later = [each for each in axes.patches if isinstance(each, Circle) and each.get_linestyle() == '--']
    moved = np.subtract([each.center for each in later], made.obstacles.centre[0])
    np.testing.assert_allclose(moved[:, 1], 0.05 * made.candidates[0].times[-1] * np.array([1.0, 2.0, 3.0]) / 3.0)
    assert 'moving obstacle, until the hand arrives' in legend_of(axes)


def test_of_a_long_name_of_a_goal_the_beginning_is_written_and_the_class_in_full():
    made = prediction(START_NS, NOWHERE).with_goal_names(('the big blue salad bowl beside the plate', 'plate'))
    axes = axes_of(made)
    assert 'the big blue sala...: right of 1' in legend_of(axes)
    assert 'the big blue sala...' in [text.get_text() for text in axes.texts]


def test_paths_below_one_percent_have_one_line_in_the_legend_and_no_letter():
    made = prediction(START_NS, NOWHERE)
    first, second, *rest = made.candidates
    for likelihoods, words in (((0.989, 0.006), '1 more path below 1 %'), ((0.004, 0.006), '2 more paths, each below 1 %')):
        changed = [replace(each, likelihood=share) for each, share in zip((first, second), likelihoods, strict=True)]
        axes = axes_of(replace(made, candidates=(*changed, *rest)))
        assert legend_of(axes).count(words) == 1 and ' 0 %' not in legend_of(axes)
        letters = {text.get_text() for text in axes.texts} & set('ABC')
        assert letters == ({'A'} if likelihoods[0] > 0.01 else set())


def test_every_path_that_is_drawn_begins_at_the_hand_also_one_that_was_solved_before():
    config = Config().with_values({'rate_hz': 10.0, 'foc.steps': 10})
    made = islice(replay(files('foc_ros') / 'recordings' / 'reaching.mcap', config), 18)
    prediction = max(made, key=lambda each: sum(one.age_s > 0.0 for one in each.candidates_with_likelihood))
    assert any(each.age_s > 0.0 for each in prediction.candidates_with_likelihood), 'unlikely ones are solved now and then'
    lines = axes_of(prediction).lines
    (now,) = [line for line in lines if line.get_label() == 'hand']
    paths = [line for line in lines if '%' in line.get_label() and len(line.get_xdata())]
    assert len(paths) > 3
    for line in paths:
        np.testing.assert_allclose(line.get_xydata()[0], now.get_xydata()[0], atol=1e-9)


def test_a_path_through_an_obstacle_is_a_ghost_with_its_reason_beside_it():
    made = prediction(START_NS, NOWHERE)  # its third candidate leads through `post`, the last one could not be solved
    axes = axes_of(made)
    ghosts = [line for line in axes.lines if line.get_color() == GHOST_COLOUR]
    assert len(ghosts) == 2 and all(line.get_alpha() < 0.5 for line in ghosts)
    written = {text.get_text(): text.xy for text in axes.texts if hasattr(text, 'xy')}
    for words, ghost in (('leads through obstacle post', ghosts[1]), ('eta unreachable', ghosts[0])):
        assert np.min(np.linalg.norm(ghost.get_xydata() - written[words], axis=1)) < 1e-9
    post = made.obstacles.ids.index('post')
    depth = np.linalg.norm(written['leads through obstacle post'] - made.obstacles.centre[post])
    assert depth < made.obstacles.radius[post]  # the words stand where the path is in the obstacle
    lost = made.candidates[-1]
    assert f'- % {lost.description}; {lost.reason}' in legend_of(axes) and lost.status.remedy in legend_of(axes)
    words = 'goal1: left of 1, right of post; leads through obstacle post'
    assert words in legend_of(axes) and 'below 1 %' not in legend_of(axes)
    unlikely = [replace(each, likelihood=min(each.likelihood, 0.001)) for each in made.candidates[2:]]
    text = legend_of(axes_of(replace(made, candidates=(*made.candidates[:2], *unlikely))))
    assert words not in text and 'below 1 %: leads through obstacle post' in text


def test_classes_stand_in_the_legend_in_words_also_those_past_many_obstacles():
    made = prediction(START_NS, NOWHERE)
    many = tuple((f'obstacle{row}', LEFT if row % 3 else RIGHT) for row in range(12))
    few = tuple((str(row), LEFT if row % 3 else RIGHT) for row in range(9))
    first, second, *rest = (replace(each, candidate=replace(each.candidate, sides=few)) for each in made.candidates)
    second = replace(second, candidate=replace(second.candidate, sides=many))
    text = legend_of(axes_of(replace(made, candidates=(first, second, *rest))))
    assert f'{first.candidate.goal_name or "goal0"}: right of 0, 3, 6, left of 1, 2, 4, 5, 7, 8' in text
    assert 'goal0: right of obstacle0, obstacle3, obstacle6, obstacle...' in text
    assert not any(each.label in text for each in made.candidates)


def test_goals_are_called_by_their_names():
    made = prediction(START_NS, NOWHERE).with_goal_names(('bowl', 'plate'))
    words = {text.get_text() for text in axes_of(made).texts}
    assert {'bowl', 'plate'} <= words and not words & {'goal0', 'goal1'}
    bowl = make_obstacles([made.goal_positions[0], [0.1, 0.2]], 0.02, ids=('bowl', 'plate'))
    written = [text.get_text() for text in axes_of(replace(made, obstacles=bowl)).texts]
    assert (written.count('bowl'), written.count('plate')) == (1, 2), 'an object that is a goal has its name once'


def with_uncertainty(made, factor):
    """Return a prediction whose total covariances are so many times its motor noise."""
    solutions = [each.solution.with_covariance(factor * each.covariance) for each in made]
    return replace(made, candidates=tuple(replace(each, solution=new) for each, new in zip(made, solutions, strict=True)))


def test_only_the_most_likely_candidate_has_its_total_uncertainty_and_no_ellipse_widens_the_axes():
    made = build_snapshot(prediction(START_NS, NOWHERE))
    wide, beyond = with_uncertainty(made, 25.0), with_uncertainty(made, 1e6)
    limits = []
    for each in (made, wide, beyond):
        axes = make_scene_figure(each).axes[0]
        limits.append((*axes.get_xlim(), *axes.get_ylim()))
        ellipses = [patch for patch in axes.patches if type(patch) is Ellipse]
        dashed = [patch for patch in ellipses if patch.get_linestyle() == '--']
        assert (len(dashed) > 2) is (each is wide)
        assert len({patch.get_facecolor() for patch in ellipses if patch not in dashed}) == 2, 'none for the ghost'
        assert all(patch.get_facecolor()[3] >= 0.3 for patch in ellipses if patch not in dashed)
        assert all(axes.bbox.fully_contains(*corner) for patch in dashed for corner in patch.get_extents().get_points())
        assert all(np.hypot(*np.subtract(one.center, other.center)) > 0.25 * other.width for one, other in pairwise(dashed))
    assert [', within the axes' in legend_of(axes_of(with_uncertainty(made, factor))) for factor in (1.1, 50.0)] == [
        False,
        True,
    ]
    assert limits[0] == limits[1] == limits[2], 'ellipses beyond the axes are left out'
    left, right, bottom, top = limits[0]
    paths = np.concatenate([each.solution.path for each in made])
    assert (paths >= [left, bottom]).all() and (paths <= [right, top]).all() and right - left < 0.35


def layouts():
    """Return axes by how they were made, as users do."""
    return {
        'new': None,
        'one': plt.figure().subplots(),
        'two': plt.figure(figsize=(6.4, 4.8)).subplots(1, 2)[1],
        'four': plt.figure(figsize=(10.0, 9.0), layout='constrained').subplots(2, 2)[1, 0],
        'placed': plt.figure().add_axes((0.1, 0.2, 0.8, 0.7)),
    }


@pytest.mark.parametrize('name', ['new', 'two', 'four'])
def test_letters_of_equal_paths_cover_neither_each_other_nor_the_reason_of_a_ghost(name):
    made = prediction(START_NS, NOWHERE)
    *_, lost = made.candidates
    found = replace(lost, solution=replace(lost.solution, status=Status.SOLVED), likelihood=0.25)
    equal = [replace(found, candidate=replace(found.candidate, label=f'goal1:{row}')) for row in range(4)]
    axes = plot_prediction(replace(made, candidates=(*equal, lost), most_likely=equal[0].label), layouts()[name])
    axes.figure.draw_without_rendering()
    point = axes.figure.dpi / 72.0
    places = {text.get_text(): axes.transData.transform(text.get_position()) for text in axes.texts if text.get_text() in 'ABCD'}
    boxes = [text.get_window_extent().padded(5.0 * point) for text in axes.texts if text.get_text() == 'eta unreachable']
    assert len(places) == 4 and len(boxes) == 1
    assert not any(box.contains(*place) for box in boxes for place in places.values())
    assert all(np.hypot(*(one - other)) > 11.0 * point for one, other in combinations(places.values(), 2))
    plt.close('all')


@pytest.mark.parametrize('name', ['new', 'one', 'two', 'four', 'placed'])
def test_a_plot_survives_subplots_and_savefig(name, tmp_path):
    """The legend is within the figure and covers no other axes, also when it is drawn again."""
    given, made = layouts()[name], widen(prediction(START_NS, NOWHERE))
    axes = plot_prediction(made, given)
    assert given is None or axes is given
    axes.plot([0.0, 0.1], [0.0, 0.1])
    counts = [(plot_prediction(made, axes), len(axes.figure.axes), len(axes.get_children()))[1:] for _ in range(3)]
    assert len({*counts}) == 1 and len([text for text in axes.texts if text.get_text() == 'A']) == 1
    axes.figure.savefig(tmp_path / 'plot.png')
    renderer = axes.figure.canvas.get_renderer()
    (below,) = [each for each in axes.figure.axes if each.get_gid() == f'legend {id(axes)}']
    boxes, whole = [each.get_window_extent(renderer) for each in legends_of(axes)], axes.figure.bbox
    assert len(boxes) == 2 and 0.0 < boxes[0].y0 - boxes[1].y1 < 10.0, 'the signs are just below the candidates'
    others = [each.get_tightbbox(renderer) for each in axes.figure.axes if each is not below]
    for box in boxes:
        assert box.x0 >= whole.x0 and box.x1 <= whole.x1 and box.y0 >= whole.y0 and box.y1 <= whole.y1
        assert not any(box.overlaps(other) for other in others)
    assert axes.get_window_extent(renderer).height > 50.0
    assert given is not None or boxes[1].y0 < 20.0, 'no empty room in a figure of its own'
    plt.close('all')


def test_a_legend_that_nobody_could_read_is_left_out_and_this_is_told(tmp_path):
    figure = plt.figure(figsize=(8.0, 6.0))
    made = prediction(START_NS, NOWHERE)
    for axes in figure.subplots(2, 2).flat:
        with pytest.warns(FocWarning, match=r'no room for a legend in axes of [\d.]+ x [\d.]+ in, .* would have [34]\.\d pt'):
            plot_prediction(made, axes)
    figure.tight_layout()
    figure.savefig(tmp_path / 'plot.png')
    assert len(figure.axes) == 4
    assert all(axes.get_window_extent().height > 150.0 for axes in figure.axes)
    plt.close('all')


def test_a_picture_without_a_solution_or_an_obstacle_shows_the_attempt_and_the_start(tmp_path):
    made = prediction(START_NS, NOWHERE)
    lost = [each for each in made.candidates if not each.is_solved]
    nothing = replace(made, candidates=tuple(lost), most_likely=None, obstacles=make_obstacles())
    write_picture(tmp_path / 'none.png', nothing)
    assert (tmp_path / 'none.png').read_bytes().startswith(PNG)
    begun = [replace(each, candidate=replace(each.candidate, guess=np.array([[-0.1, 0.02], [0.3, 0.0]]))) for each in lost]
    axes = make_scene_figure(replace(made, candidates=tuple(begun))).axes[0]
    assert any(np.array_equal(line.get_xydata(), [[-0.1, 0.02]]) for line in axes.lines)
    assert axes.get_xlim()[0] < -0.1
