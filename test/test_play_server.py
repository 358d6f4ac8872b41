# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The web server of `foc_ros play`: what it serves, and to whom; and its messages, clock, scene, tasks and predictor."""

import asyncio
import gc
import json
import math
import os
import signal
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('tornado', reason='tornado is not installed')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from bag_helpers import TYPES
from play_helpers import play, until
from report_samples import START_NS, prediction
from session_helpers import BOX, CIRCLE, SCENE, TASKS, parse
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from foc_ros.cli.main import main
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.solution import Status
from foc_ros.play.address import open_sockets
from foc_ros.play.messages import LONGEST_MESSAGE, PageClock, parse_message
from foc_ros.play.predictor import Predictor, State
from foc_ros.play.scene import FIRST_SCENE, START, View
from foc_ros.play.server import FILES, listen
from foc_ros.play.session import Session
from foc_ros.play.tasks import Phase, Tasks, tabulate_scores
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud
from foc_ros.ros.messages.decode_poses import decode_goals
from foc_ros.ros.messages.encode_inputs import encode_hand_pose

HAND = {'type': 'hand', 't': 10.0, 'x': 0.1, 'y': 0.0, 'event': None}


@pytest.fixture
def sockets():
    """Collect the sockets of refused connections after a test, which Tornado leaves to the garbage collector."""
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', ResourceWarning)
        yield
        gc.collect()


def serve(tmp_path, test):
    """Run a coroutine with the address of a server whose predictor was not started."""

    async def run():
        session = Session(Predictor, Config(), tmp_path)
        sockets = open_sockets('127.0.0.1', 0)
        server = listen(session, '127.0.0.1', sockets)
        try:
            await test(f'127.0.0.1:{sockets[0].getsockname()[1]}')
        finally:
            server.stop()
            await server.close_all_connections()

    asyncio.run(run())


async def get(address, path, **headers):
    return await AsyncHTTPClient().fetch(f'http://{address}{path}', headers=headers, raise_error=False)


async def connect(address, origin='', **headers):
    request = HTTPRequest(f'ws://{address}/socket', headers={'Origin': origin or f'http://{address}'} | headers)
    return await websocket_connect(request)


async def read(socket, kind):
    """Return the next message of a kind."""
    while (text := await asyncio.wait_for(socket.read_message(), 20)) is not None:
        message = json.loads(text)
        if message['type'] == kind:
            return message
    raise AssertionError(f'closed before a message {kind}')


@pytest.mark.usefixtures('sockets')
def test_only_files_of_the_page_are_served(tmp_path):
    async def test(address):
        for path, file in FILES.items():
            response = await get(address, path)
            assert (response.code, response.body) == (200, file.read_bytes())
            assert "default-src 'none'" in response.headers['Content-Security-Policy']
            assert response.headers['X-Content-Type-Options'] == 'nosniff'
        for path in ('/report', '/server.py', '/../server.py', '/%2e%2e/server.py', '//etc/passwd', '/page/play.js', '/socket/x'):
            assert (await get(address, path)).code == 404, path

    serve(tmp_path, test)


@pytest.mark.usefixtures('sockets')
def test_another_page_and_a_name_that_was_made_to_lead_here_are_refused(tmp_path):
    async def test(address):
        port = address.rpartition(':')[2]
        for path in ('/', '/play.js', '/report', '/socket'):
            assert (await get(address, path, Host=f'attacker.example:{port}')).code == 404
        assert (await get(address, '/', Host=f'localhost:{port}')).code == 200
        for origin in ('http://attacker.example', f'http://127.0.0.1:{int(port) - 1}', 'null', f'http://localhost:{port}'):
            with pytest.raises(HTTPClientError, match='403'):
                await connect(address, origin)
        with pytest.raises(HTTPClientError, match='404'):
            await connect(address, f'http://attacker.example:{port}', Host=f'attacker.example:{port}')
        (await connect(address)).close()

    serve(tmp_path, test)


@pytest.mark.usefixtures('sockets')
def test_bad_messages_are_refused_and_harm_nothing(tmp_path):
    async def test(address):
        socket = await connect(address)
        assert (await read(socket, 'scene'))['goals']
        for text, error in (
            ('', 'message: expected JSON'),
            (json.dumps(HAND | {'x': 1e300}), 'hand.x: expected a number <= 0.38, got 1e+300'),
            (json.dumps({'type': 'job', 'name': 'fit'}), 'job: expected a session that was recorded, got fit'),
        ):
            await socket.write_message(text)
            assert error in (await read(socket, 'error'))['text']
        await socket.write_message(b'\xff\x00', binary=True)
        assert 'message: expected JSON' in (await read(socket, 'error'))['text']
        await socket.write_message(json.dumps(HAND))
        await socket.write_message(json.dumps(HAND))
        assert 'hand.t: expected a time after the last one, 10.0 ms' in (await read(socket, 'error'))['text']
        await socket.write_message('x' * (LONGEST_MESSAGE + 1))  # closes this connection only
        assert await socket.read_message() is None
        other = await connect(address)
        assert (await read(other, 'hello'))['max_speed'] > 0.0
        other.close()
        assert not any(tmp_path.iterdir())

    serve(tmp_path, test)


@pytest.mark.usefixtures('sockets')
def test_a_wrong_option_is_refused_in_one_line(tmp_path, capsys):
    with (tmp_path / 'file').open('w'):
        pass
    for arguments, error in (
        (['--port', '70000'], '--port: expected a whole number in [0, 65535], got 70000'),
        (['--host', '203.0.113.1', '--port', '0'], '--host and --port: expected a free port of this computer'),
        (['--host', 'a..b', '--port', '0'], '--host and --port: expected a free port of this computer'),
        (['--data', str(tmp_path / 'file'), '--port', '0'], '--data: expected a folder'),
    ):
        assert main(['play', *arguments]) == 2
        assert error in capsys.readouterr().err


def test_the_command_ends_when_it_is_interrupted(tmp_path):
    """All other servers of these tests end by SIGTERM, with the same exit code."""
    with play(tmp_path, '--host', '0.0.0.0') as started:
        assert started.output.startswith('foc_ros play: loading ...\n')
        assert 'warning: everybody who reaches 0.0.0.0 can steer the hand' in started.output
        started.process.send_signal(signal.SIGINT)
        assert started.process.wait(30) == 0


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('tornado', "play needs tornado: install python3-tornado, or pip install 'foc_ros[play]'"),
        ('pydantic', "scene files and the page need pydantic of version 2: pip install 'pydantic>=2'"),
    ],
)
def test_without_a_library_the_message_says_what_to_install(tmp_path, name, words):
    (tmp_path / f'{name}.py').write_text('raise ImportError')
    paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[1]), *filter(None, [os.environ.get('PYTHONPATH')])])
    command = [sys.executable, '-m', 'foc_ros', 'play', '--port', '0', '--data', str(tmp_path / 'data')]
    environment = os.environ | {'PYTHONPATH': paths}
    result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=100, check=False)
    assert result.returncode == 2
    assert result.stderr == f'foc_ros play: {words}\n'


NOW_NS = 10**15
PART_HAND = {'type': 'hand', 't': 10.0, 'x': 0.1, 'y': 0.0, 'event': 8.0}


@pytest.mark.parametrize(
    ('message', 'error'),
    [
        ('[' * 20_000, 'message: expected JSON'),
        ('[]', r'message: expected .*, got \[\]'),
        ({'type': 'open', 'file': '/etc/passwd'}, "message: expected .* 'hand', 'scene', .* got .*'open'"),
        (PART_HAND | {'x': math.nan}, r'hand\.x: expected a finite number, got nan'),
        (PART_HAND | {'y': '0'}, r"hand\.y: expected a number, got '0'"),
        (PART_HAND | {'t': -1}, r'hand\.t: expected a number >= 0, got -1'),
        (PART_HAND | {'event': True}, r'hand\.event: expected a number, got True'),
        (PART_HAND | {'topic': '/x'}, r"hand\.topic: expected no such field, got '/x'"),
        ({'type': 'hand', 't': 1.0}, r'hand\.x: expected a value, got nothing'),
        (SCENE | {'goals': []}, r'scene\.goals: expected a list of at least 1, got \[\]'),
        (SCENE | {'goals': {}}, r'scene\.goals: expected a list, got \{\}'),
        (SCENE | {'obstacles': [CIRCLE] * 33}, r'scene\.obstacles: expected a list of at most 32, got '),
        (SCENE | {'obstacles': [CIRCLE, BOX | {'size_y': 5}]}, r'obstacles\[1\]\.box\.size_y: expected a number <= 0\.3, got 5'),
        (SCENE | {'obstacles': [CIRCLE | {'kind': 'hull'}]}, r"obstacles\[0\]: expected .* 'circle', 'box'"),
        (SCENE | {'obstacles': [7]}, r'obstacles\[0\]: expected .*, got 7'),
        ({'type': 'shuffle', 'seed': 1.5}, r'shuffle\.seed: expected a valid integer, got 1\.5'),
        (TASKS | {'trials': 0}, r'tasks\.trials: expected a number >= 1, got 0'),
        (TASKS | {'assistance': 'some'}, r"tasks\.assistance: expected 'mixed', 'with' or 'without', got 'some'"),
        ({'type': 'guidance', 'on': 1}, r'guidance\.on: expected a valid boolean, got 1'),
        ({'type': 'job', 'name': '../../x'}, r"job\.name: expected 'report', 'fit' or 'compare'"),
        ({'type': 'parameters', 'name': '/etc/x.yaml'}, r"parameters\.name: expected 'standard' or 'mine'"),
        ({'type': 'stop', 'on': True}, r'stop\.on: expected no such field, got True'),
    ],
)
def test_a_bad_message_is_refused_with_field_value_and_bound(message, error):
    with pytest.raises(InputError, match=error):
        parse_message(message if isinstance(message, str) else json.dumps(message))


def test_a_scene_reaches_the_node_as_it_was_arranged():
    scene = parse(SCENE)
    assert parse(scene.model_dump()) == scene
    messages = scene.encode(TYPES, 5)
    decoded, given = decode_point_cloud(messages['obstacles'], 'xy'), scene.tabulate()
    assert (decoded.obstacles.ids, decoded.stamp_ns, decoded.frame_id) == (given.ids, 5, 'play')
    for name in ('centre', 'radius', 'radius_stddev', 'corners', 'vertices'):
        np.testing.assert_allclose(getattr(decoded.obstacles, name), getattr(given, name), atol=1e-8)
    np.testing.assert_allclose(decode_goals(messages['goals'], 'xy')[0], [[0.3, 0.0]])


def test_stamps_follow_the_quickest_message_and_never_step_back():
    clock, second = PageClock(), 10**9
    assert clock.stamp(1000.0, 100 * second) == 100 * second
    # this message took 50 ms less: those after it count from there
    assert clock.stamp(1060.0, 100 * second + 10_000_000) == 100 * second + 10_000_000
    assert clock.stamp(1080.0, 100 * second + 90_000_000) == 100 * second + 30_000_000
    # 20 ms later it took 40 ms less again: its stamp would step back
    assert clock.stamp(1090.0, 100 * second) is None
    assert clock.stamp(1130.0, 100 * second + 45_000_000) == 100 * second + 40_000_000
    with pytest.raises(InputError, match=r'hand\.t: expected a time after the last one, 1130\.0 ms, got 1130\.0'):
        clock.stamp(1130.0, 101 * second)
    with pytest.raises(InputError, match=r'hand\.t: expected a time before .* ms, got 9000000000'):
        clock.stamp(9e9, 101 * second)
    assert clock.stamp(1140.0, 100 * second + 60_000_000) == 100 * second + 50_000_000


@pytest.mark.parametrize('count', [2, 3, 12])
def test_trials_with_and_without_guidance_and_their_goals_occur_about_equally_often(count):
    for seed in range(5):
        trials = Tasks(parse(TASKS | {'trials': count, 'seed': seed}), FIRST_SCENE).trials
        assert abs(sum(1 if each.is_guided else -1 for each in trials)) == count % 2
        if count == 12:
            assert len({(each.goal, each.is_guided) for each in trials}) == 6


def test_a_trial_is_scored():
    """The hand moves along x at 0.1 m/s through a circle, and the way of number 7 is the most likely one from x = 0.1 m on."""
    scene = parse(SCENE | {'obstacles': [CIRCLE | {'x': 0.15}]})
    tasks = Tasks(parse(TASKS | {'trials': 1, 'assistance': 'without'}), scene)
    assert [tasks.follow(0.0, (0.2, 0.0)), tasks.follow(0.1, START)] == [None, Phase.WAIT]
    assert tasks.follow(0.2, (0.1, 0.0)) is Phase.RETURN
    begin = next(t for t in (0.3 + 0.01 * step for step in range(200)) if tasks.follow(t, START) is Phase.REACH)
    assert 0.4 <= begin - 0.3 <= 0.91
    t = 0.0
    while tasks.phase is Phase.REACH:
        t += 0.01
        position = (min(0.1 * t, 0.3), 0.0)
        tasks.follow(begin + t, position)
        tasks.note_most_likely(begin + t, 7 if position[0] >= 0.1 else 3)
        assert t < 10.0
    assert tasks.phase is Phase.OVER
    assert tasks.follow(begin + 9.0, START) is None
    (score,) = tasks.scores
    assert score.touched == 1
    assert score.time_s == pytest.approx(2.85, abs=0.02)  # at the edge of the goal
    assert score.path_m == pytest.approx(0.3, abs=0.02)
    assert score.ahead_s == pytest.approx(1.85, abs=0.03)
    numbers = f'{score.time_s:.2f}', '1', f'{100.0 * score.path_m:.1f}', f'{score.ahead_s:.2f}'
    assert tabulate_scores([score]) == [('without guidance', '1', *numbers)]


def test_a_pose_that_is_refused_is_no_sign_of_the_hand():
    """The age of the hand, at which guidance releases it, is that of the last pose that was used."""
    predictor = Predictor(Config(), lambda _: None)
    pose = encode_hand_pose(TYPES, NOW_NS, 'play', (0.0, 0.0, 0.0))
    predictor._take('hand_pose', pose)
    noted = predictor._guidance.newest
    predictor._take('hand_pose', pose)
    assert predictor._guidance.newest is noted


def test_no_prediction_begins_at_a_pose_that_waited_for_the_one_before(monkeypatch):
    """The next pose is as near as the next frame, and its prediction shows a younger hand."""
    step_ns, stamps = 20_000_000, list[int]()
    predictor = Predictor(Config(), lambda outcome: isinstance(outcome, View) and stamps.append(outcome.prediction.stamp_ns))
    compute = Pipeline.predict

    def send(number):
        predictor.send('hand_pose', encode_hand_pose(TYPES, NOW_NS + number * step_ns, 'play', (0.001 * number, 0.0, 0.0)))

    def predict_while_a_pose_comes(pipeline, deadline):
        send(2 * len(stamps) + 1)
        return compute(pipeline, deadline)

    monkeypatch.setattr(Pipeline, 'predict', predict_while_a_pose_comes)
    for role, message in FIRST_SCENE.encode(TYPES, NOW_NS).items():
        predictor.send(role, message)
    predictor.start()
    try:
        for number in range(3):
            until(predictor._queue.empty, 'the poses before are taken', 20)
            send(2 * number)
            until(lambda count=number + 1: len(stamps) == count, 'a prediction', 20)
    finally:
        predictor.stop()
    assert stamps == [NOW_NS + number * step_ns for number in (0, 2, 4)]


def test_the_state_is_well_only_while_predictions_succeed():
    """It fails where the pipeline fails, no path is found, all paths are from before, or the thread is gone."""
    predictor = Predictor(Config(budget_s=0.0), lambda _: None)
    assert predictor.check().level == 'failing', 'not started'
    predictor.start()
    try:
        assert (predictor.check().level, 'hand' in predictor.check().text) == ('waiting', True)
        for role, message in FIRST_SCENE.encode(TYPES, NOW_NS).items():
            predictor.send(role, message)
        predictor.send('hand_pose', encode_hand_pose(TYPES, NOW_NS, 'play', (0.0, 0.0, 0.0)))
        until(lambda: predictor._recent, 'a prediction', 20)
        assert predictor.check() == State('well', 'predicting')
        made = prediction(START_NS, np.zeros(2))
        lost = replace(made, candidates=made.candidates[-1:])
        held = replace(made, candidates=tuple(replace(each, age_s=0.1) for each in made.candidates[:3]))
        cut = replace(made.candidates[0], solution=replace(made.candidates[0].solution, status=Status.DEADLINE))
        late = replace(made, candidates=(made.candidates[0], replace(cut, way=1), *made.candidates[2:]))
        unfinished = replace(made, candidates=(cut, *made.candidates[1:]))
        inside = replace(made, obstacles=make_obstacles(made.candidates[0].mean[:1, :2], 0.01))
        for recent, level, words in (
            ([made], 'well', 'predicting'),
            ([made, lost], 'failing', 'no path to any goal can be found'),
            ([held] * 11 + [made] * 9, 'failing', 'this computer is too busy'),
            ([held] * 10 + [made] * 10, 'well', 'predicting'),
            ([late] * 11 + [made] * 9, 'waiting', 'predicting, but some dotted paths'),
            ([late] * 10 + [made] * 10, 'well', 'predicting'),
            ([made, unfinished], 'waiting', 'predicting, but some dotted paths'),
            ([unfinished, made], 'well', 'predicting'),
            ([late, inside], 'waiting', 'predicting, but the hand is inside obstacle 0'),
        ):
            predictor._recent.clear()
            predictor._recent.extend(recent)
            assert predictor.check().level == level and predictor.check().text.startswith(words)
        predictor._recent.append(unfinished)
        predictor.configure(Config(budget_s=0.002))
        until(lambda: predictor.check().text.endswith('not finished within 0.002 s (budget_s)'), 'the cause', 20)
        predictor._note_error(ValueError('x'))
        assert predictor.check() == State('failing', 'internal error: x')
    finally:
        predictor.stop()
    assert predictor.check().text.startswith('predictions have ended')
