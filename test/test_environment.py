# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Commands in unusual environments: they work, or one sentence says why not."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from bag_helpers import CONFIG, messages, write_bag, write_parameters

from foc_ros.core.config import replace_values
from foc_ros.io.bags import BagReader
from foc_ros.io.class_library import load_library

HOMELESS = {'HOME': '/dev/null', 'XDG_CACHE_HOME': '/dev/null', 'XDG_CONFIG_HOME': '/dev/null'}
ASCII = {'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0'}


def start(*arguments, options=(), **environment):
    command = [sys.executable, *options, '-m', 'foc_ros', *arguments]
    given = {**os.environ, **environment}
    return subprocess.Popen(command, env=given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding='utf-8')


def test_a_report_and_a_bag_are_written_whatever_the_environment(tmp_path):
    bag = write_bag(tmp_path / 'été 手', messages(seconds=0.1))
    written = '--report', str(tmp_path / 'Bild ü'), '--output', str(tmp_path / 'out 手')
    process = start('replay', str(bag), *written, options=('-O',), MPLBACKEND='notabackend', **HOMELESS, **ASCII)
    out, err = process.communicate()
    assert process.returncode == 0 and 'Traceback' not in err and f'report: {(tmp_path / "Bild ü").as_uri()}' in out
    assert 'été 手' in (tmp_path / 'Bild ü' / 'index.html').read_text('utf-8')
    with BagReader(tmp_path / 'out 手') as reader:
        assert len(list(reader)) == len(messages(seconds=0.1))


def test_a_node_without_a_place_for_its_log_says_so():
    pytest.importorskip('rclpy')
    process = start('node', **HOMELESS, ROS_LOG_DIR='/dev/null/log')
    assert process.communicate()[1].splitlines()[-1] == 'foc_node: ROS_LOG_DIR names another directory for the log'
    assert process.returncode == 2


def test_of_processes_that_write_at_once_two_learn_into_one_library_and_one_of_two_writes_their_output(tmp_path):
    library, output = tmp_path / 'library.json', tmp_path / 'out'
    parameters = write_parameters(tmp_path, replace_values(CONFIG, {'rate_hz': 2.0}))
    # two movements, which differ in their speed
    bags = [write_bag(tmp_path / str(number), messages(seconds=1.02, rate_hz=50.0 + 10 * number)) for number in range(2)]
    learning = [start('replay', str(bag), '--params', parameters, '--learn', str(library)) for bag in bags]
    writing = [start('replay', str(bags[0]), '--params', parameters, '--output', str(output)) for _ in range(2)]
    lines = [process.communicate()[1].splitlines() for process in learning + writing]
    told = [[line for line in each if not line.startswith('replay, ')] for each in lines]  # progress on a busy machine
    assert [process.returncode for process in learning] == [0] * 2
    assert len(load_library(str(library))) == 2
    assert [each.name for each in tmp_path.iterdir() if each.name.startswith('library')] == ['library.json']
    assert sorted(process.returncode for process in writing) == [0, 2]
    refused = f'foc_ros replay: {output}: exists already and is not overwritten; choose another name'
    assert sorted(told) == [[], [], [], [refused]]
    with BagReader(output) as reader:
        assert len(list(reader)) == len(messages(seconds=1.02))


ROOT = Path(__file__).parents[1]
LIMIT_S = 60.0


def test_an_import_is_left_at_once(tmp_path):
    (tmp_path / 'endless.py').write_text('import signal\nsignal.raise_signal(signal.SIGINT)\nwhile True: pass\n')
    command = [sys.executable, '-c', 'from foc_ros.__main__ import handle_interrupts\nwith handle_interrupts(): import endless']
    environment = os.environ | {'PYTHONPATH': f'{tmp_path}{os.pathsep}{ROOT}'}
    ended = subprocess.run(command, env=environment, capture_output=True, timeout=LIMIT_S, check=False)
    assert (ended.returncode, ended.stderr) == (130, b'foc_ros: stopped\n')


@pytest.mark.parametrize('turn', [0, 6])
def test_a_command_is_interrupted_at_any_moment(turn):
    """The moments lie in the imports, in the solve and in the sampling after it."""
    command = ['solve', 'doc/examples/scene.yaml', '--monte-carlo', '10000000']
    program = f'import sys\nfrom foc_ros.__main__ import main\nprint(flush=True)\nsys.exit(main({command}))'
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    with subprocess.Popen([sys.executable, '-c', program], cwd=ROOT, **pipes) as process:
        assert process.stdout.readline() == '\n'
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.02 + random.Random(turn).uniform(0.0, 0.25 * turn))
        process.send_signal(signal.SIGINT)
        try:
            _, errors = process.communicate(timeout=LIMIT_S)
        finally:
            process.kill()
    assert (process.returncode, errors) == (130, 'foc_ros: stopped\n')
