# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pages of evaluations and fits, and views of predictions: those of the records and of the node's messages agree."""

import itertools
from dataclasses import replace
from datetime import datetime
from importlib.metadata import version
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from bag_helpers import TYPES
from matplotlib.figure import Figure
from report_samples import START_NS, prediction, samples, scene

from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, RecordingError
from foc_ros.core.solution import Status
from foc_ros.io.bags import TYPESTORE, BagReader
from foc_ros.reporting import study_pages
from foc_ros.reporting.draw import CLASS_COLOURS, save_figure
from foc_ros.reporting.page import FOLDER, Section, write_page
from foc_ros.reporting.study_pages import draw_example
from foc_ros.reporting.study_pages import write_fit as write_report
from foc_ros.reporting.views import (
    SLOTS,
    HandTrajectory,
    Slots,
    build_candidate_tracks,
    build_hand_trajectory,
    build_snapshot,
    is_late,
    read_snapshot,
)
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud
from foc_ros.ros.messages.ranking import compute_cost_ratios

RECORDING = Path(__file__).resolve().parents[1] / 'foc_ros' / 'recordings' / 'reaching.mcap'
ANSWER = {
    'recordings': 2,
    'parameters': {
        'likelihood.beta': {'value': 0.5, 'interval': [0.4, 0.7], 'how': 'classes taken', 'given': 1.0},
        'foc.noise_x': {'value': 0.08, 'interval': [0.06, 0.1], 'how': 'spread', 'given': 0.05},
        'duration.intercept_s': {'value': 0.0, 'interval': [0.0, 0.1], 'how': 'durations', 'given': 0.0},
    },
    'chosen': {'duration.arrival': {'value': 'passing', 'given': 'rest'}},
    'undetermined': {'foc.eta': {'given': 0.9, 'why': 'flat'}},
    'scores': {'ways': {'uniform': -1.0, 'as given': -1.0, 'fitted': -0.75, 'held out': -0.8}, 'positions': {'held out': None}},
    'comparison': {'error_m 0.5': {'before': 0.063, 'after': 0.096}, 'inside_90': {'before': 0.5, 'after': 0.8}},
    'warnings': ['<b>few</b> recordings'],
    'failed': {'x.mcap': 'no hand'},
    'output': 'mine.yaml',
    'node': ['here', 'there'],
}


def test_the_page_holds_values_intervals_scores_and_warnings(tmp_path):
    write_report(tmp_path / 'new', 'hers & his', ANSWER)
    page = (tmp_path / 'new' / 'fit.html').read_text(encoding='utf-8')
    assert '<title>Fit: hers &amp; his</title>' in page
    assert '<tr><th>likelihood.beta</th><td>1</td><td>0.5</td><td>0.4 to 0.7</td><td>classes taken</td></tr>' in page
    assert '<td>0.06 to 0.1</td>' in page
    assert '<tr><th>log-likelihood of the path taken [nat]</th><td>uniform, as given</td><td>-1.000</td></tr>' in page
    row = '<th>error of positions 0.5 s ahead [mm]</th><td>63.0</td><td>96.0</td><td>worse</td>'
    assert row in page and 'Better on the same recordings, with the fitted parameters: positions in' in page
    held_out = (
        'recordings held out, by the likelihood and the widening alone: log-likelihood of the path taken [nat] -1.000 to -0.800.'
    )
    assert page.index(f'Better on {held_out}') < page.index('Better on the same recordings')
    assert '&lt;b&gt;few&lt;/b&gt; recordings' in page and 'x.mcap: no hand' in page
    assert page.count('<img') == 1
    assert 'held out: likelihood and widening fitted to' in page
    assert page.index('Fitted to 2 recordings, 3 parameters changed, 2 kept.') < page.index('<table')
    assert '<tr><th>foc.eta</th><td>0.9</td><td>flat</td></tr>' in page.partition('Parameters that keep their values')[2]
    write_report(tmp_path, 'x', ANSWER | {'parameters': {}})
    assert '<img' not in (tmp_path / 'fit.html').read_text(encoding='utf-8'), 'without parameters there are tables only'
    with pytest.raises(InputError, match='--report'):
        write_report(tmp_path / 'fit.html', 'x', ANSWER)


class Recorded:
    """The packaged recording, as one of a folder of recordings, or one that cannot be read."""

    def __init__(self, is_broken=False):
        self.is_broken = is_broken

    def items(self):
        if self.is_broken:
            raise RecordingError('broken')
        with BagReader(RECORDING) as reader:
            yield from islice(reader, 250)


def test_a_recording_is_pictured_with_its_prediction_and_one_that_cannot_be_read_is_passed_over():
    config = Config().with_values({'rate_hz': 10.0, 'foc.steps': 20})
    (section,) = draw_example({'broken': Recorded(is_broken=True), 'whole': Recorded()}, config)
    ((_, caption),) = section.pictures
    assert caption.startswith('whole, 0.') and caption.endswith('after the hand began to move.')
    assert draw_example({'broken': Recorded(is_broken=True)}, config) == []


def test_a_page_names_what_made_it_and_no_path(tmp_path):
    config = Config().with_values({'foc.eta': 0.8, 'homotopy.library': '/elsewhere/mine.json'})
    write_page(tmp_path, 'x.html', 'x', [Section('In short', ['a < b'])], (), config)
    page = (tmp_path / 'x.html').read_text(encoding='utf-8')
    assert '<li>a &lt; b</li>' in page
    footer = page.partition('<footer')[2].partition('</footer>')[0]
    assert f'Made by foc_ros {version("foc_ros")} on {datetime.now().astimezone():%Y-%m-%d}; ' in footer
    assert 'processors' in footer and 'foc.eta = 0.8' in footer and 'homotopy.library = mine.json' in footer
    assert 'someone' not in page and str(Path.cwd()) not in page
    write_page(tmp_path, 'x.html', 'x', [], (), Config())
    assert 'All parameters have their defaults.' in (tmp_path / 'x.html').read_text(encoding='utf-8')


def test_results_of_a_simulation_are_told_in_plain_words_first():
    cell = {'operator': 'changes_way', 'collision_rate': 0.1, 'completion_s': 1.234}
    cells = [cell | {'assistance': 'none'}, cell | {'assistance': 'foc', 'collision_rate': 0.05, 'completion_s': None}]
    assert study_pages.study.make_summary(cells)[1:] == [
        'Changes way: collisions in 5 % of the trials with guidance; '
        'collisions in 10 % of the trials and 1.23 s for a movement without guidance.'
    ]


@pytest.mark.parametrize('factor', [1.02, 12.0, 900.0])
def test_labels_of_the_axis_of_a_fit_are_apart_and_rules_are_named_in_words(factor):
    figure = Figure((6.4, 2.6), layout='constrained')
    axes = figure.subplots()
    study_pages._draw_multiples(axes, {'a': {'given': 1.0, 'value': factor, 'interval': [1.0 / factor, factor]}})
    figure.draw_without_rendering()
    low, high = axes.get_xlim()
    labels = [each for each in axes.get_xticklabels() if low <= each.get_position()[0] <= high]
    boxes = [each.get_window_extent() for each in labels]
    assert len(labels) >= 3 and all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))
    cell = {'operator': 'noisy', 'trials': 20, 'collision_rate': 0.1, 'collision_rate_interval': [0.0, 0.2]}
    study_pages._draw_measure(
        axes := Figure().subplots(), [cell | {'assistance': each} for each in ('none', 'foc')], 'collision_rate'
    )
    assert axes.get_legend_handles_labels()[1] == ['without guidance', 'with guidance']


@pytest.mark.parametrize(('count', 'has_bars'), [(5, False), (6, True)])
def test_few_recordings_or_trials_have_no_bars(count, has_bars):
    one = {'count': 30, 'recordings': count, 'confidence': 0.6, 'right': 0.5, 'interval': [0.4, 0.7]}
    cell = {
        'operator': 'noisy',
        'assistance': 'foc',
        'trials': count,
        'collision_rate': 0.1,
        'collision_rate_interval': [0.0, 0.2],
    }
    by_predictor = {name: {'reliability': [one]} for name in ('foc', 'foc, held out', 'Boltzmann')}
    for draw, given in (
        (study_pages._draw_reliability, ('way', by_predictor)),
        (study_pages._draw_measure, ([cell], 'collision_rate')),
    ):
        draw(axes := Figure().subplots(), *given)
        (bars,) = axes.containers[0].lines[2]
        assert np.isfinite(bars.get_segments()).any() == has_bars


def test_movements_are_found_where_they_are_and_tremor_is_none():
    spans = build_hand_trajectory(samples(3)).find_movements()
    np.testing.assert_allclose((np.array(spans) - START_NS) * 1e-9, [[0.5, 1.5], [2.0, 3.0], [3.5, 4.5]], atol=0.15)
    random = np.random.default_rng(3)
    hand = HandTrajectory(START_NS + np.arange(300) * 10_000_000, random.normal(scale=0.003, size=(300, 2)))
    assert hand.speed.max() > 0.05
    assert hand.find_movements() == []


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_the_messages_hold_everything_that_a_report_shows(plane):
    """Also when another class is the most likely one by hysteresis, and after serialisation."""
    made = replace(prediction(START_NS, np.array([0.01, -0.02])), most_likely='goal1:+1-post')
    statuses = Status.DEADLINE, Status.COMPROMISED, Status.ESTIMATED
    pairs = zip(made.candidates, statuses, strict=False)
    ended = [replace(each, solution=replace(each.solution, status=status)) for each, status in pairs]
    made = replace(made, candidates=(*ended, *made.candidates[len(ended) :]))
    messages = encode_prediction_cloud(made, plane, TYPES), encode_likelihoods(made, TYPES)
    carried = [TYPESTORE.deserialize_cdr(TYPESTORE.serialize_cdr(each, each.__msgtype__), each.__msgtype__) for each in messages]
    read, known = read_snapshot(*carried, plane, *scene()), build_snapshot(made)
    assert (read.stamp_ns, read.most_likely) == (known.stamp_ns, known.most_likely)
    above = replace(made.obstacles, heights=np.array([[-np.inf, np.inf], [0.2, 0.3]]))  # the hand is at a height of 0.1 m
    assert read_snapshot(*carried, plane, above, made.goal_positions).cleared == (False, True)
    assert [each.label for each in read] == [each.label for each in known.candidates_with_likelihood]
    assert read.candidates[0].label == 'goal1:+1-post'
    assert is_late(read) and {each.status for each in read.candidates} == set(statuses)
    ratios = [compute_cost_ratios(each.candidates_with_likelihood) for each in (read, known)]
    assert ratios[0] == pytest.approx(ratios[1])
    for got, expected in zip(read, known.candidates_with_likelihood, strict=True):
        for name in ('description', 'status', 'likelihood', 'effort', 'eta'):
            assert getattr(got, name) == getattr(expected, name)
        for name in ('times', 'mean', 'covariance', 'motor_covariance'):
            np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-6, atol=1e-8)


def test_letters_and_colours_differ_while_there_are_any_and_are_kept_over_an_absence():
    slots = Slots()
    assert slots.assign(range(6)) == list(range(6)), 'in order of likelihood'
    assert slots.assign([7, 3]) == [6, 3], 'a letter that has been free for longest'
    assert slots.assign([3, 0, 8]) == [3, 0, 7]
    many = slots.assign(range(20, 31))
    assert sorted(many[:SLOTS]) == list(range(SLOTS)) and many[SLOTS] is None
    assert slots.assign([3])[0] in range(SLOTS) and len({*CLASS_COLOURS}) == SLOTS
    assert str([*CLASS_COLOURS]) in (FOLDER / 'scene.js').read_text(encoding='utf-8'), 'pages have the same ones'


def test_paths_below_one_percent_take_no_letter_from_others_and_keep_their_own():
    made = build_snapshot(prediction(START_NS, np.zeros(2)))
    shares = np.array([[*(SLOTS * [0.001]), 0.99], [*(SLOTS * [0.1]), 0.0], [0.005, *((SLOTS - 1) * [0.11]), 0.0]])
    ways = [
        replace(made.candidates[0], candidate=replace(made.candidates[0].candidate, label=f'{way}'), way=way)
        for way in range(SLOTS + 1)
    ]
    given = [tuple(replace(each, likelihood=share) for each, share in zip(ways, row, strict=True)) for row in shares.tolist()]
    tracks = build_candidate_tracks([replace(made, candidates=each) for each in given])
    assert [tracks.slots.get(each) for each in tracks.tracks[0].values()] == [*(SLOTS * [None]), 0]
    assert {tracks.slots[tracks.tracks[1][f'{way}']] for way in range(SLOTS)} == set(range(SLOTS))
    assert tracks.tracks[2] == tracks.tracks[1]


def test_a_page_that_cannot_be_written_to_its_end_leaves_the_earlier_one(tmp_path):
    resource = pytest.importorskip('resource')
    write_page(tmp_path, 'x.html', 'first', [], (), None)
    earlier, (limit, most) = (tmp_path / 'x.html').read_text(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, most))
    try:
        with pytest.raises(InputError, match='File too large'):
            write_page(tmp_path, 'x.html', 'second', [], (), None)
        with pytest.raises(InputError, match='File too large'):
            save_figure(Figure(), tmp_path / 'x.png')
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
    assert [each.name for each in tmp_path.iterdir()] == ['x.html'] and (tmp_path / 'x.html').read_text() == earlier
