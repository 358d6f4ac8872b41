# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report: a page that needs no other file, numbers that agree with the predictions, and what it may replace."""

import json
from dataclasses import replace
from html.parser import HTMLParser
from importlib.metadata import version

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from matplotlib.figure import Figure
from report_samples import GOALS, OBSTACLES, START_NS, prediction, predictions, samples, widen

from foc_ros.analysis.replay import Step
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.core.scene import Scene
from foc_ros.core.solution import Status
from foc_ros.core.types import HandSample
from foc_ros.io.bags import Item
from foc_ros.io.outputs import REPORT_FILES, check_page, check_replaceable
from foc_ros.reporting.encode import LENGTH, MOST_TIMES, compute_recording_bounds, select_evenly
from foc_ros.reporting.figures import write_picture
from foc_ros.reporting.page import write_page
from foc_ros.reporting.report import ReportCollector, describe_late, write_report
from foc_ros.reporting.views import build_hand_trajectory, build_snapshot, choose_moment
from foc_ros.ros.messages.ranking import find_drawn_curve


class Page(HTMLParser):
    def __init__(self, file):
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text = ''
        self.feed(file.read_text(encoding='utf-8'))
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in ('meta', 'img', 'input', 'link', 'br'):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_the_page_opens_at_a_moment_whose_paths_are_finished():
    made = [prediction(START_NS + row * 10**8, np.zeros(2), 0.8) for row in range(3)]
    (first, second, *rest) = prediction(made[0].stamp_ns, np.zeros(2), 0.45).candidates
    unfinished = [replace(each, solution=replace(each.solution, status=Status.DEADLINE)) for each in (first, second)]
    made[1] = replace(made[1], candidates=(*unfinished, *rest))
    assert choose_moment(made, START_NS - 10**8, START_NS + 4 * 10**8) in (0, 2)
    made[1] = replace(made[1], candidates=(first, second, *rest))
    assert choose_moment(made, START_NS - 10**8, START_NS + 4 * 10**8) == 1


def test_a_long_rest_at_the_end_of_a_movement_does_not_decide_which_moment_is_shown():
    times_ns = [300_000_000, 500_000_000, *range(700_000_000, 1_000_000_000, 50_000_000)]
    made = [prediction(START_NS + each, np.zeros(2), 0.45 if row == 0 else 0.8) for row, each in enumerate(times_ns)]
    for row in range(2, len(made)):
        calm = [replace(each, solution=each.solution.with_covariance(1e-4 * each.covariance)) for each in made[row].candidates]
        made[row] = replace(made[row], candidates=tuple(calm))
    assert choose_moment(made, START_NS, START_NS + 10**9) == 0


def test_the_first_movement_shown_is_no_way_back():
    made = [prediction(START_NS, np.zeros(2), 0.8)]
    out = [HandSample(START_NS, np.zeros(2)), HandSample(START_NS + 10**9, GOALS[0])]
    back = build_hand_trajectory([replace(each, position=end.position) for each, end in zip(out, out[::-1], strict=True)])
    assert build_hand_trajectory(out).approaches_goal(START_NS, START_NS + 10**9, made)
    assert not back.approaches_goal(START_NS, START_NS + 10**9, made)
    assert not build_hand_trajectory(out).approaches_goal(START_NS, START_NS + 10**9, []), 'nothing was predicted'


def test_an_unlikely_path_does_not_widen_the_picture():
    hand, made = build_hand_trajectory([HandSample(START_NS, np.zeros(2))]), prediction(START_NS, np.zeros(2), 0.8)
    first = made.candidates[0]
    wild = replace(first.solution, mean=10.0 * first.solution.mean)
    added = [replace(first, solution=wild, likelihood=share) for share in (0.0, 0.005, 0.5)]
    bounds = [compute_recording_bounds(hand, [replace(made, candidates=(*made.candidates, each))]) for each in added]
    assert bounds[0] == bounds[1] and bounds[2][1] > 2.0 * bounds[0][1]


def report(directory, reaches=1, title='A title'):
    made = samples(reaches)
    snapshots = [build_snapshot(each) for each in predictions(made)]
    return write_report(directory, title, build_hand_trajectory(made), snapshots, {'recording': 'some <bag> & more'})


def test_the_report_is_a_page_without_other_files(tmp_path):
    """Text is escaped, facts are shown, and nothing is loaded from anywhere; the input is left alone."""
    before = OBSTACLES.centre.copy()
    file = report(tmp_path / 'new' / 'report', title='<img src=x onerror=alert(1)>')
    np.testing.assert_array_equal(OBSTACLES.centre, before)
    assert {each.name for each in file.parent.iterdir()} == {'index.html', 'predictions.json'}
    page = Page(file)
    for tag, attributes in page.tags:
        assert tag != 'img' and not {'href', 'src', 'srcset', 'action'} & attributes.keys()
    policy = next(attributes['content'] for _, attributes in page.tags if 'http-equiv' in attributes)
    assert policy.startswith("default-src 'none'") and 'http' not in policy
    assert ('meta', {'name': 'viewport', 'content': 'width=device-width, initial-scale=1'}) in page.tags
    for words in ('some <bag> & more', '4.0 ms (median)', '38 candidates ended with status eta_unreachable'):
        assert words in page.text


def test_page_and_numbers_agree_with_the_predictions(tmp_path):
    made = samples(2)
    expected = [widen(each) for each in predictions(made)]
    write_report(tmp_path, 'x', build_hand_trajectory(made), [build_snapshot(each) for each in expected], {})
    numbers, data = json.loads((tmp_path / 'predictions.json').read_text(encoding='utf-8')), page_data_of(tmp_path)
    assert numbers['hand_samples'] == len(made)
    assert data['times'] == pytest.approx([each['t_s'] for each in numbers['predictions']], abs=1e-4)
    for row, (frame, written, known) in enumerate(zip(data['frames'], numbers['predictions'], expected, strict=True)):
        assert frame['at'] == row
        assert (written['stamp_ns'], written['most_likely']) == (known.stamp_ns, known.most_likely)
        assert written['t_s'] == pytest.approx((known.stamp_ns - START_NS) * 1e-9)
        shares = {each.label: pytest.approx(each.likelihood, rel=1e-5) for each in known.solved_candidates}
        assert {each['label']: each['likelihood'] for each in written['candidates']} == shares
        for candidate in frame['candidates']:
            track = data['tracks'][candidate['track']]
            assert shares[data['labels'][candidate['label']]] == track['share'][row - track['first']]
        assert written['candidates'][0]['end'] == pytest.approx(known.solved_candidates[0].solution.path[-1], abs=1e-6)
        assert written['unsolved'] == {'goal1:+1+post': 'eta_unreachable'}
        check_paths(frame, known, data['labels'])
    assert data['unknown'] == [0.25] * len(expected)


def check_paths(frame, known, labels):
    """Check that a frame has the paths and ellipses of a prediction, and the reason why one could not be solved."""
    for candidate, outcome in zip(frame['candidates'], known.solved_candidates, strict=True):
        drawn = np.cumsum([candidate['x'], candidate['y']], axis=1).T * LENGTH
        curve = find_drawn_curve(outcome)
        np.testing.assert_allclose(drawn, curve[select_evenly(len(curve), len(drawn))], atol=0.51e-4)
        shown = {'motor': outcome.motor_covariance, 'total': outcome.covariance}
        assert bool(candidate['total']) is (candidate is frame['candidates'][0])
        for name, covariance in [each for each in shown.items() if candidate[each[0]]]:
            spread = np.array(candidate[name])[-1, 2:4] * LENGTH
            wanted = np.sqrt(np.linalg.eigvalsh(covariance[-1, :2, :2]))[::-1]
            np.testing.assert_allclose(spread, wanted, atol=0.51e-4)
    (lost,) = frame['unsolved']
    assert labels[lost['reason']].endswith(f'remedy: {Status.ETA_UNREACHABLE.remedy}')
    drawn = np.cumsum([lost['x'], lost['y']], axis=1).T * LENGTH
    np.testing.assert_allclose(drawn[[0, -1]], known.candidates[-1].solution.path[[0, -1]], atol=0.51e-4)


def test_of_a_recording_that_begins_anew_the_last_run_is_shown(tmp_path):
    made, collector = samples(), ReportCollector(Config().with_values({'foc.eta': 0.8}))
    for sample in (*made[:100], *made):
        shown = prediction(sample.stamp_ns, sample.position) if sample.stamp_ns % 10**8 == 0 else None
        collector.add(Step(Item('hand_pose', '/hand_pose', sample.stamp_ns, None, b''), sample, shown, Scene()))
    collector.write(tmp_path, 'x', {})
    numbers = json.loads((tmp_path / 'predictions.json').read_text(encoding='utf-8'))
    footer = (tmp_path / 'index.html').read_text(encoding='utf-8').partition('<footer')[2].partition('</footer>')[0]
    assert f'Made by foc_ros {version("foc_ros")} on ' in footer and 'do not have their defaults: foc.eta = 0.8.' in footer
    assert numbers['hand_samples'] == len(made) and numbers['summary']['runs'] == '2, of which the last one is shown'
    assert [each['t_s'] for each in numbers['predictions']] == pytest.approx(np.arange(15) / 10.0)


def test_a_long_recording_is_thinned_out_and_its_page_stays_below_a_megabyte_and_a_half(tmp_path):
    """45 s at 100 Hz with six candidates: the slider stops at fewer of the predictions, evenly spread."""
    made = samples(30)
    many = [replace(each, candidates=each.candidates[:3] * 2) for each in predictions(made, every=1)]
    snapshots = []
    for view in map(build_snapshot, many):
        named = [(row, each, replace(each.candidate, label=f'{each.label}{row}')) for row, each in enumerate(view)]
        snapshots.append(replace(view, candidates=tuple(replace(each, way=row, candidate=new) for row, each, new in named)))
    write_report(tmp_path, 'x', build_hand_trajectory(made), snapshots, {})
    assert (tmp_path / 'index.html').stat().st_size < 1_500_000
    data = page_data_of(tmp_path)
    # obstacles and goals that do not change are stored once
    assert len(data['scenes']) == len(data['goals']) == 1
    assert data['count'] == len(snapshots) == 4_500 and len(data['times']) == MOST_TIMES
    at = [data['times'][frame['at']] for frame in data['frames']]
    assert len(at) > 50 and at[0] == 0.0 and at[-1] == data['times'][-1]
    assert np.ptp(np.diff(at)) < 0.025, 'evenly, up to two samples'
    assert len(json.loads((tmp_path / 'predictions.json').read_text(encoding='utf-8'))['predictions']) == 4_500


def end_with(snapshot, *statuses):
    """Return a snapshot whose likeliest candidates have ended otherwise, and without one that is lost."""
    shown = snapshot.candidates_with_likelihood
    pairs = zip(shown, statuses, strict=False)
    ended = [replace(each, solution=replace(each.solution, status=status)) for each, status in pairs]
    return replace(snapshot, candidates=(*ended, *shown[len(ended) :]))


def test_a_busy_computer_is_told_once_with_what_to_change_and_an_estimate_is_not_called_compromised(tmp_path):
    made = [build_snapshot(each) for each in predictions(samples())]
    hand = build_hand_trajectory(samples())

    def told(snapshots):
        write_report(tmp_path, 'x', hand, snapshots, {})
        numbers = json.loads((tmp_path / 'predictions.json').read_text(encoding='utf-8'))
        return numbers['warnings'], numbers['summary']

    count = len(made)
    calm = [end_with(each, Status.SOLVED, Status.ESTIMATED, Status.COMPROMISED) for each in made]
    warnings, facts = told([end_with(calm[0], Status.DEADLINE), *calm[1:]])
    assert warnings == [] and describe_late(calm) == ''
    shown = f'{count - 1} avoid the obstacles as surely as wanted, {count} less surely; {count + 1} are estimates'
    assert facts['paths with at least 1 %'] == f'{3 * count}: {shown}'
    busy = [end_with(each, Status.DEADLINE) for each in made[:10]] + calm[10:]
    (words,), _ = told(busy)
    assert words == describe_late(busy) and words.startswith(f'This computer was too busy for 10 of {count} predictions')
    assert 'rate_hz' in words and 'homotopy.max_candidates' in words and 'budget_s' in words
    (words,), _ = told([end_with(each, Status.COMPROMISED) for each in made[:5]] + calm[5:])
    assert words.startswith(f'In 5 of {count} predictions the most likely path avoids the obstacles less surely than wanted')


def page_data_of(directory):
    text = (directory / 'index.html').read_text(encoding='utf-8')
    return json.loads(text.partition('id="report-data">')[2].partition('</script>')[0])


def test_unusual_recordings_have_a_report_that_says_what_is_missing(tmp_path):
    """Without predictions, without a solved candidate, with a hand that never moves, and with a number that is not finite."""
    hand, made = build_hand_trajectory(samples()), prediction(START_NS, np.zeros(2))
    file = write_report(tmp_path / 'none', 'x', hand, [], {})
    assert 'There is no prediction.' in Page(file).text
    lost = tuple(each for each in made.candidates if not each.is_solved)
    file = write_report(tmp_path / 'lost', 'x', hand, 3 * [build_snapshot(replace(made, candidates=lost, most_likely=None))], {})
    assert 'In 3 of 3 predictions no candidate could be solved.' in Page(file).text
    still = build_hand_trajectory([HandSample(START_NS + n * 10_000_000, np.zeros(2)) for n in range(50)])
    view = build_snapshot(prediction(int(still.stamps_ns[20]), np.zeros(2)))
    strange = replace(view.candidates[0], solution=replace(view.candidates[0].solution, eta=float('nan')))
    unknown = replace(view, candidates=(strange, *view.candidates[1:]))
    write_report(tmp_path / 'still', 'x', still, [unknown], {})
    text = (tmp_path / 'still' / 'predictions.json').read_text(encoding='utf-8')
    assert 'NaN' not in text and json.loads(text)['predictions'][0]['candidates'][0]['eta'] is None


def test_what_foc_ros_has_made_is_replaced_and_no_other_file_is(tmp_path):
    for suffix in ('png', 'pdf', 'svg'):
        write_picture(tmp_path / f'scene.{suffix}', prediction(START_NS, np.zeros(2)))
        check_replaceable('--plot', tmp_path / f'scene.{suffix}')
    report(tmp_path)
    check_page('--report', tmp_path, *REPORT_FILES)
    write_page(tmp_path, 'index.html', 'x', (), (), None)
    Figure().savefig(tmp_path / 'holiday.png')
    with pytest.raises(InputError, match='--plot: expected a new file, or one that foc_ros has made'):
        check_replaceable('--plot', tmp_path / 'holiday.png')
    for name in ('index.html', 'predictions.json'):
        folder = tmp_path / name.partition('.')[0]
        folder.mkdir()
        (folder / 'other.html').write_text('mine', 'utf-8')
        check_page('--report', folder, *REPORT_FILES)
        (folder / name).write_text('mine', 'utf-8')
        with pytest.raises(InputError, match='--report: expected a new file, or one that foc_ros has made'):
            check_page('--report', folder, *REPORT_FILES)
