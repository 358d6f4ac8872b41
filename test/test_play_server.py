# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The web server of `foc_ros play`: what it serves, and to whom."""

import asyncio
import gc
import json
import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

pytest.importorskip('tornado', reason='tornado is not installed')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from play_helpers import play
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from foc_ros.cli.main import main
from foc_ros.core.config import Config
from foc_ros.play.address import open_sockets
from foc_ros.play.messages import LONGEST_MESSAGE
from foc_ros.play.predictor import Predictor
from foc_ros.play.server import FILES, listen
from foc_ros.play.session import Session

HAND = {'type': 'hand', 't': 10.0, 'x': 0.1, 'y': 0.0, 'event': None}


@pytest.fixture(autouse=True)
def _no_warning_of_sockets():
    """Collect the sockets of refused connections here, which Tornado leaves to the garbage collector."""
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


def test_a_name_that_was_made_to_lead_here_is_refused(tmp_path):
    async def test(address):
        port = address.rpartition(':')[2]
        for path in ('/', '/play.js', '/report', '/socket'):
            assert (await get(address, path, Host=f'attacker.example:{port}')).code == 404
        assert (await get(address, '/', Host=f'localhost:{port}')).code == 200

    serve(tmp_path, test)


def test_another_page_cannot_connect(tmp_path):
    async def test(address):
        port = address.rpartition(':')[2]
        for origin in ('http://attacker.example', f'http://127.0.0.1:{int(port) - 1}', 'null', f'http://localhost:{port}'):
            with pytest.raises(HTTPClientError, match='403'):
                await connect(address, origin)
        with pytest.raises(HTTPClientError, match='404'):
            await connect(address, f'http://attacker.example:{port}', Host=f'attacker.example:{port}')
        (await connect(address)).close()

    serve(tmp_path, test)


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


def test_a_wrong_option_is_refused_in_one_line(tmp_path, capsys):
    with (tmp_path / 'file').open('w'):
        pass
    for arguments, error in (
        (['--port', '70000'], 'Invalid value "70000" for --port. Must be <= 65535.'),
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
