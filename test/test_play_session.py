# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A session of `foc_ros play`: tasks, recordings, the fit and its comparison, and what is refused."""

import asyncio
import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from evaluation_samples import use_few_predictions
from reach_helpers import make_predictor
from report_samples import predictions, samples
from session_helpers import SCENE, TASKS, Page, Silent, reach, wait_until

from foc_ros.analysis.recordings import find_recordings
from foc_ros.analysis.replay import Replay
from foc_ros.cli.main import main
from foc_ros.core.config import Config, replace_values
from foc_ros.core.errors import InputError
from foc_ros.io.bags import BagReader
from foc_ros.play import jobs, recording, tasks
from foc_ros.play.predictor import State
from foc_ros.play.scene import BOUNDS, FIRST_SCENE, START, view_prediction
from foc_ros.play.session import Session
from foc_ros.reporting.encode import LENGTH
from foc_ros.ros.parameters import dump_parameter_file


def make_page(folder, monkeypatch, config):
    """Return a page of a session whose clock goes on with the time of the page."""
    session = Session(Silent, config, folder)
    session.predictor.start()
    page = Page(session)
    for module in ('session', 'recording'):
        monkeypatch.setattr(f'foc_ros.play.{module}.time_ns', lambda: 10**15 + round(page.t_ms * 1e6))
    return page


@pytest.fixture
def page(tmp_path, monkeypatch):
    return make_page(tmp_path / 'data', monkeypatch, Config())


def test_tasks_leave_bags_that_fit_and_evaluate_read(page):
    page.send(TASKS)
    with pytest.raises(InputError, match='scene: expected no change while tasks run'):
        page.send(SCENE)
    for _ in range(2):
        reach(page)
    assert page.last('task') == {'type': 'task', 'phase': 'none'}
    assert sorted(row[0] for row in page.last('score')['rows']) == ['with guidance', 'without guidance']
    assert [each.guidance.enabled for each in page.session.predictor.configs] in ([True, False], [True])
    folder = Path(page.last('settings')['session'])
    assert page.last('settings')['unguided'] is True
    (name,) = recordings = find_recordings(folder / recording.UNGUIDED)
    replay = Replay(Config(rate_hz=5.0))
    steps = list(replay.steps(recordings[name].items()))
    stamps = [step.sample.stamp_ns for step in steps if step.sample is not None]
    assert {round(gap) for gap in np.diff(stamps)} == {20_000_000}
    assert any(step.prediction is not None and step.prediction.candidates_with_likelihood for step in steps)
    assert replay.describe_losses() == ''
    with BagReader(folder / recording.SESSION) as reader:
        assert sum(item.role == 'hand_pose' for item in reader) > len(stamps)
    asyncio.run(work(page, 'report'))
    report = page.session.report.read_text(encoding='utf-8')
    assert report.index('<h2>Score</h2>') < report.index('<h2>Recording</h2>'), 'the result comes first'
    assert f'<td>{page.last("score")["rows"][0][2]}</td>' in report
    page.send({'type': 'record', 'on': True})
    again = Page(page.session)
    assert 'score' not in [each['type'] for each in again.received], 'it is of the session before'
    again.send({'type': 'record', 'on': False})


def test_a_prediction_of_the_hand_before_the_light_is_ahead_by_the_time_of_the_trial():
    movement = tasks.TrialMovement(tasks.Trial(FIRST_SCENE, 0, False), 10.0, START)
    movement.note_most_likely(9.9, 1)
    for t in (11.0, 11.4):
        is_over = movement.add(t, FIRST_SCENE.points[0])
    assert is_over and movement.ahead_s == movement.time_s == 1.0


def test_a_blinded_page_learns_nothing_from_what_it_receives(page):
    """The page receives no prediction, and the same messages with and without guidance; the force itself must be felt."""
    received = {}
    for assistance in ('with', 'without'):
        page.send(TASKS | {'assistance': assistance, 'blinded': True})
        begin = len(page.received)
        page.move(START, 100)
        page.session._receive(view_prediction(predictions(samples())[0]))
        received[assistance] = page.received[begin:]
        page.send({'type': 'stop'})
    assert received['with'] == received['without']
    assert {each['type'] for each in received['with']} == {'task', 'status'}


async def work(page, name):
    """Press the button of a job, and return what the page is told at its end."""
    page.send({'type': 'job', 'name': name})
    await wait_until(lambda: page.last('job')['state'] != 'running', 800.0)
    assert page.last('job')['state'] == 'done', page.last('job')
    return page.last('job')


def record_trials(page, count):
    page.send(TASKS | {'trials': count, 'assistance': 'without'})
    for _ in range(count):
        reach(page)


QUICK = Config().with_values({'rate_hz': 5.0, 'foc.steps': 15, 'homotopy.max_candidates': 2})


def test_a_fit_and_its_comparison(tmp_path, monkeypatch):
    """The commands behind the buttons, on three trials, in this process and with few predictions and settings."""

    async def run_here(note, *arguments):
        with contextlib.redirect_stdout(io.StringIO()) as output:
            assert main([*map(str, arguments), '--workers', '1']) == 0
        return output.getvalue()

    async def run():
        fitted = await work(page, 'fit')
        assert fitted['state'] == 'done' and '6 trials or more are needed' in fitted['text']
        assert page.last('result')['columns'] == ['parameter', 'before', 'after']
        assert {row[0].partition('.')[0] for row in page.last('result')['rows']} == {'estimator'}
        compared = await work(page, 'compare')
        assert 'on the trials of the fit' in compared['text']
        scores = [row[0] for row in page.last('result')['rows']]
        assert scores[:2] == ['path: correct [%]', 'path: log-likelihood [nat]']

    use_few_predictions(monkeypatch)
    monkeypatch.setattr(jobs, 'run_command', run_here)
    page = make_page(tmp_path, monkeypatch, QUICK)
    record_trials(page, 3)
    asyncio.run(run())
    assert page.last('settings')['fitted']
    page.send({'type': 'parameters', 'name': 'mine'})  # the page keeps the others if positions become worse
    assert page.last('settings')['parameters'] == 'mine'
    mine = page.session.predictor.configs[-1]
    assert mine.estimator != QUICK.estimator
    assert mine.plane == 'xy'
    page.send({'type': 'parameters', 'name': 'standard'})
    assert page.session.predictor.configs[-1] == QUICK


FITTED = {'likelihood.beta': 7.5}


def fit_with_errors(page, monkeypatch, before_m, after_m, failed=None):
    """Press the button of the fit; in place of the command, write FITTED, with the errors of positions before and after it."""

    async def fit(note, *arguments):
        note('replays: 20 of 40')
        given = list(map(str, arguments))
        assert given[0] == 'fit' and given[given.index('--allow') + 1] == 'positions'
        Path(given[given.index('--output') + 1]).write_text(dump_parameter_file(replace_values(Config(), FITTED)))
        parameters = {name: {'given': 4.0, 'value': value} for name, value in FITTED.items()}
        comparison = {'class_gain': {'before': 0.1, 'after': 0.3}, 'error_m 0.5': {'before': before_m, 'after': after_m}}
        chosen = {'foc.eta': {'given': 0.9, 'value': 0.9}}  # not shown, because it has not changed
        return json.dumps(
            {'recordings': 6, 'parameters': parameters, 'chosen': chosen, 'comparison': comparison, 'failed': failed or {}}
        )

    monkeypatch.setattr(jobs, 'run_command', fit)
    return asyncio.run(work(page, 'fit'))


BETTER = 'Predictions now use your parameters.'
WORSE = (
    'Predicted positions 0.5 s ahead become worse with the fitted parameters: from 63 to 96 mm. '
    'Predictions use the standard parameters, unless you choose yours.'
)
UNUSED = {'trial_002': 'nothing could be predicted'}


@pytest.mark.parametrize(('after_m', 'text', 'used'), [(0.060, BETTER, 'mine'), (0.096, WORSE, 'standard')])
def test_the_page_predicts_with_the_fit_unless_positions_become_worse_and_says_so(page, monkeypatch, after_m, text, used):
    record_trials(page, 1)
    configs = {'standard': Config(), 'mine': replace_values(Config(), FITTED)}
    fitted = fit_with_errors(page, monkeypatch, 0.063, after_m, UNUSED)
    assert fitted['text'] == f'{text} Not used: trial_002 (nothing could be predicted).'
    assert page.last('result')['rows'] == [['likelihood.beta', '4', '7.5']]
    assert (page.last('settings')['parameters'], page.last('settings')['fitted']) == (used, True)
    assert page.session.predictor.configs[-1] == configs[used]
    page.send({'type': 'parameters', 'name': 'mine'})
    assert page.session.predictor.configs[-1] == configs['mine']
    # the next fit is as good: its parameters are not used because those before it were
    fit_with_errors(page, monkeypatch, 0.063, after_m)
    assert page.last('settings')['parameters'] == used and page.session.predictor.configs[-1] == configs[used]

    async def evaluate(*_):
        return json.dumps({'questions': {}, 'positions': NO_POSITIONS, 'failed': UNUSED})

    monkeypatch.setattr(jobs, 'run_command', evaluate)
    assert asyncio.run(work(page, 'compare'))['text'].endswith(' Not used: trial_002 (nothing could be predicted).')


INPUTS = {'/hand_pose', '/obstacles', '/goals'}
NO_POSITIONS = {'displacement_m': {'likelihood-weighted': {'average': {'0.5': None}}}, 'nlpd': {'foc': {'0.5': None}}}


def test_what_is_impossible_is_refused(page):
    for message, error in (
        ({'type': 'job', 'name': 'report'}, 'job: expected a session that was recorded, got report'),
        ({'type': 'parameters', 'name': 'mine'}, 'parameters: expected standard until parameters were fitted, got mine'),
    ):
        with pytest.raises(InputError, match=error):
            page.send(message)
    page.send({'type': 'record', 'on': True})
    page.move(START, 3)
    page.send({'type': 'record', 'on': False})
    with pytest.raises(InputError, match='job: expected a session with trials without guidance, got fit'):
        page.send({'type': 'job', 'name': 'fit'})
    assert (page.last('settings')['recording'], page.last('settings')['unguided']) == (False, False)


def test_a_fit_shows_its_progress_and_can_be_cancelled(page, tmp_path, monkeypatch):
    record_trials(page, 1)
    program, ended = tmp_path / 'program', tmp_path / 'ended'
    # it ends by itself, too, if this process is killed
    program.write_text(f"#!/bin/sh\ntrap 'touch {ended}; exit 1' TERM\necho 'replays: 20 of 60' >&2\nsleep 30 &\nwait\n")
    program.chmod(0o755)
    monkeypatch.setattr(jobs.sys, 'executable', str(program))

    async def run():
        page.send({'type': 'job', 'name': 'fit'})
        await wait_until(lambda: page.last('job')['text'] == 'replays: 20 of 60')
        assert page.last('job')['state'] == 'running'
        await asyncio.sleep(0.2)
        again = Page(page.session)  # a page that is loaded again is told how long the job has run
        assert again.last('job')['seconds'] >= page.last('job')['seconds'] + 0.2
        again.send({'type': 'cancel'})
        await wait_until(lambda: again.last('job')['state'] == 'cancelled')
        await wait_until(ended.exists)

    asyncio.run(run())
    assert page.last('settings')['fitted'] is False


def test_only_the_newest_page_steers(page):
    other = Page(page.session)
    assert page.last('replaced') == {'type': 'replaced'}
    before = len(page.session.predictor.sent)
    page.move(START)
    assert len(page.session.predictor.sent) == before
    other.move(START)
    assert [role for role, _ in page.session.predictor.sent[before:]] == ['hand_pose']


@pytest.mark.parametrize('begin', [{'type': 'record', 'on': True}, TASKS | {'assistance': 'with'}], ids=['recording', 'tasks'])
def test_a_full_disk_ends_recording_and_tasks_and_nothing_else(page, monkeypatch, begin):
    def fail(*_):
        raise OSError(28, 'No space left on device')

    page.send(begin)
    monkeypatch.setattr('rosbags.rosbag2.Writer.write', fail)
    page.move(START)
    assert 'No space left' in page.last('error')['text']
    settings = page.last('settings')
    assert (settings['recording'], settings['guided'], page.last('task')['phase']) == (False, False, 'none')
    assert [each.guidance.enabled for each in page.session.predictor.configs] in ([], [True, False])
    page.move(START)


def test_predictions_are_shown_and_recorded_beside_the_inputs(page):
    """Paths on the page lead from the hand to their goals within the scene; the bag holds what was sent and predicted."""
    page.send({'type': 'record', 'on': True})
    page.move(START, 60)
    made = make_predictor(Config(budget_s=0.0), FIRST_SCENE.points, FIRST_SCENE.tabulate()).update(0.0, START)
    page.session.predictor.state = State('waiting', 'unfinished')
    page.session._receive(view_prediction(replace(made, stamp_ns=page.session._hands[-1][0])))
    assert page.last('status')['text'] == 'unfinished', 'the page is told at once'
    page.send({'type': 'record', 'on': False})
    shown = page.last('prediction')
    shares = [shown['other'], *(each['likelihood'] or 0.0 for each in shown['candidates'])]
    assert sum(shares) == pytest.approx(1.0, abs=2e-3)
    for each in shown['candidates']:
        assert (each['slot'] is None) is ((each['likelihood'] or 0.0) < 0.01), 'unlikely paths take no colour'
    low_x, high_x, low_y, high_y = BOUNDS
    for each in shown['candidates']:
        path = np.cumsum([each['x'], each['y']], axis=1).T * LENGTH
        assert ((path >= [low_x, low_y]) & (path <= [high_x, high_y])).all()
        np.testing.assert_allclose(path[[0, -1]], [START, FIRST_SCENE.points[each['goal']]], atol=2e-3)
    with BagReader(Path(page.last('settings')['session']) / recording.SESSION) as reader:
        assert {each.topic for each in reader._channels} == {*INPUTS, '/foc/prediction', '/foc/likelihoods'}
        assert {item.topic for item in reader} == INPUTS
    asyncio.run(work(page, 'report'))
    numbers = json.loads((page.session.report.parent / 'predictions.json').read_text(encoding='utf-8'))
    assert (numbers['hand_samples'], len(numbers['predictions'])) == (60, 1)
