# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program: exit codes, errors in one line, no unnecessary imports, and output that fits into 80 columns."""

import io
import itertools
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from foc_ros.__main__ import main as run_program
from foc_ros.cli import main as command_line
from foc_ros.cli.options import confirm
from foc_ros.core.errors import InputError, warn
from foc_ros.io import terminal
from foc_ros.io.terminal import COLUMNS, show_table

ROOT = Path(__file__).parents[1]


def start(program, *arguments, **options):
    command = [sys.executable, '-c', program, *arguments]
    given = {'cwd': ROOT, 'capture_output': True, 'text': True, 'timeout': 100, 'check': False}
    return subprocess.run(command, **given | options)


@pytest.mark.parametrize(
    ('arguments', 'line'),
    [
        (['fly'], 'foc_ros fly: Unknown command "fly". Available commands: demo, play, '),
        (['evalute', 'bags'], 'foc_ros evalute: Unknown command "evalute". Did you mean "evaluate"?'),
        (['convert'], 'foc_ros convert: Command "convert" parameter CSV requires an argument.'),
        (['replay', '.', '--prams', 'a'], 'foc_ros replay: Unknown option: --prams. Did you mean --params?\n'),
        (['replay', '.', 'more'], "foc_ros replay: Unused Tokens: ['more']."),
        (['evaluate', '.', '--workers', '0'], 'foc_ros evaluate: --workers: expected a whole number in [1, 1024], got 0'),
        (['replay', '.', '--json=maybe'], 'foc_ros replay: Invalid value for --json: unable to convert "maybe" into bool.'),
        (['evaluate', '.', '--workers', '2', '--scheduler', 'host:8786'], 'foc_ros evaluate: --scheduler: expected either '),
        (['replay', '.', '--output', 'a', '--output', 'b'], 'foc_ros replay: Parameter --output specified multiple times.'),
        (['evaluate', 'x' * 300], 'foc_ros evaluate: [Errno 36] File name too long'),
        (['paper'], 'foc_ros paper: the studies of the paper are an example now: python examples/paper/paper.py\n'),
        (['replay', 'no_such_bag'], 'foc_ros replay: Invalid value "no_such_bag" for BAG. "no_such_bag" does not exist.'),
    ],
)
def test_wrong_arguments_exit_2_with_one_line(arguments, line, capsys):
    assert command_line.main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == '' and err.startswith(line) and err.count('\n') == 1


def test_wrong_parameters_of_the_node_are_answered_together(tmp_path, capsys):
    file = tmp_path / 'wrong.yaml'
    file.write_text('/**: {ros__parameters: {foc: {etta: 0.5}, use_sim_time: true}}')
    given = ['-p', 'rate_hz:=-1', '--params-file', str(file), '-p', 'foc.steps:=1e1', '-p', 'qos_overrides./a.b:=x']
    assert command_line.main(['node', '--ros-args', *given]) == 2
    assert capsys.readouterr().err.splitlines() == [
        'foc_node: foc.etta: expected a known parameter (did you mean foc.eta?), got 0.5',
        'foc_node: rate_hz: expected a number in [0.1, 1000] Hz, got -1',
    ]


HEAVY = """
import sys
from foc_ros.cli.main import list_commands, main
for arguments in (['--help'], *([name, '--help'] for name in list_commands())):
    assert main(arguments) == 0
print(sorted({'numpy', 'rclpy', 'rosbags', 'piqp'} & set(sys.modules)))
"""


def test_help_imports_nothing_heavy():
    result = start(HEAVY)
    assert result.returncode == 0 and result.stdout.endswith('\n[]\n'), result.stderr


def test_help_names_every_command_and_explains_every_argument(capsys):
    assert command_line.main(['--help']) == command_line.main([]) == 0
    shown = capsys.readouterr().out
    for command in command_line.list_commands():
        assert (f' {command} ' in shown) == (command != 'warm-up'), 'a command that does nothing is not offered'
        assert command_line.main([command, '--help']) == 0
        explained = capsys.readouterr().out
        for argument in command_line.app[command].assemble_argument_collection(parse_docstring=True):
            if argument.name != '*':  # options that several commands have, which follow one by one
                assert argument.parameter.help and argument.name in explained, f'{command} {argument.name}'


SCENE = 'start: [0, 0]\ngoal: [0.3, a]\nstepz: 5\nobstacles: [{x: 0.1, y: 0, radius: -1}]\n'
WRONG_SCENE = (
    "goal[1]: expected a number, got 'a'",
    'obstacles[0].radius: expected a number >= 0, got -1',
    'stepz: expected a known field (did you mean steps?), got 5',
)
TABLES = {
    'recordings.csv': 'recording,t_s,x_m,y_m\na,0,0,0\na,x,0.1,0\nb,0,0,0\nb,1,0.1,y\n',
    'obstacles.csv': 'x_m,y_m,radius_m\n0.1,0,0.01\n',
    'goals.csv': 'x_m,y_m\n0.3,0\n',
}
NO_NUMBERS = (
    "tables/recordings.csv: row 3, column t_s: expected a number in [0, 86400], got 'x'",
    "tables/recordings.csv: row 5, column y_m: expected a number in [-10000, 10000], got 'y'",
)
NAMES = '--operators: expected names of accurate, noisy, laggy, changes_way, unannounced_goal, human_paths'
KINDS = 'hand_pose, obstacles, obstacle_markers, collision_objects, detections, goals, goal_pose'
PEOPLE = '--recordings: expected recordings of people for the operator human_paths, got none'
INPUTS = f'--remap: expected one of the inputs {KINDS}'
NEW_FILE = 'expected a new file, or an earlier one of this kind'
NEW_PICTURE = 'expected a new file, or one that foc_ros has made'
NO_LIBRARY = 'ways: expected a list of at most 500 ways, got NoneType'
NO_NODE = '/start: expected ros__parameters with parameters below it, got [0, 0]'
NO_PARAMETERS = 'expected a section for the node /foc, such as /** or /foc, got str'
SCHEDULER = '--scheduler: expected the address of a Dask scheduler, as in tcp://host:8786'

WRONG = [
    (['solve', 'scene.yaml'], WRONG_SCENE),
    (['solve', 'scene.yaml', '--plot', 'a.gif'], ['--plot: expected a name that ends in .png, .pdf, .svg, got a.gif']),
    (['solve', 'scene.yaml', '--monte-carlo', '0'], ['--monte-carlo: expected a whole number in [1, 10000000], got 0']),
    (['solve', 'scene.yaml', '--monte-carlo', 'x'], ['--monte-carlo: expected a whole number in [1, 10000000], got x']),
    (['solve', 'scene.yaml', '--plot', 'mine.png'], [f'--plot: {NEW_PICTURE}, got mine.png, which it has not made']),
    (['solve', 'scene.yaml', '--plot', 'no/a.png'], ['--plot: expected a file in a directory that exists, got no/a.png']),
    (['simulate', '--operators', 'noisi,x'], [f'{NAMES} (did you mean noisy?), got noisi', f'{NAMES}, got x']),
    (['simulate', '--assistance', 'magic'], ['--assistance: expected names of none, foc, got magic']),
    (['simulate', '--operators', 'human_paths'], [PEOPLE]),
    (['simulate', '--trials', '1.6'], ['--trials: expected a whole number in [1, 100000], got 1.6']),
    (['simulate', '--seed', '-1'], ['--seed: expected a whole number in [0, 100000], got -1']),
    (['simulate', '--report', 'scene.yaml'], ['--report: expected a folder, got scene.yaml, which is a file']),
    (['replay', 'bag.mcap', '--remap', 'hand_pos:=/a'], [f'{INPUTS} (did you mean hand_pose?), got hand_pos']),
    (['replay', 'bag.mcap', '--remap', 'hand_pose:='], ['--remap: expected INPUT:=TOPIC, got hand_pose:=']),
    (['replay', 'bag.mcap', '--learn', 'no/a'], ['--learn: expected a file in a directory that exists, got no/a']),
    (['evaluate', 'tables'], NO_NUMBERS),
    (['evaluate', 'scene.yaml'], ['scene.yaml: expected a bag directory, a .mcap or a .db3 file']),
    (['evaluate', 'tables', '--report', 'scene.yaml'], ['--report: expected a folder, got scene.yaml, which is a file']),
    (['fit', '.', '--output', 'a', '--params', 'nowhere.yaml'], ['nowhere.yaml: cannot be read: No such file or directory']),
    (['fit', '.', '--output', 'no/a'], ['--output: expected a file in a directory that exists, got no/a']),
    (
        ['fit', '.', '--output', 'a', '--allow', 'etta'],
        ['--allow: expected names of eta, positions (did you mean eta?), got etta'],
    ),
    (['evaluate', '.', '--scheduler', 'here'], [f'{SCHEDULER}, got here']),
    (['learn', 'tables', '--output', 'tables/goals.csv'], [f'--output: {NEW_FILE}, got tables/goals.csv: {NO_LIBRARY}']),
    (['fit', 'tables', '--output', 'tables/goals.csv'], [f'--output: {NEW_FILE}, got tables/goals.csv: {NO_PARAMETERS}']),
    (['replay', 'bag.mcap', '--operator', 'scene.yaml'], [f'--operator: {NEW_FILE}, got scene.yaml: {NO_NODE}']),
    (['learn', '.', '--output', '/proc/sys/a'], ['--output: expected a file that can be written, got /proc/sys/a']),
]
ANSWERS = """
import contextlib, io, json, sys
from foc_ros.cli.main import main
for arguments in json.loads(sys.argv[1]):
    with contextlib.redirect_stderr(io.StringIO()) as errors:
        code = main(arguments)
    print(json.dumps([code, errors.getvalue().splitlines()]))
print("foc_ros.core.ocp.solver" in sys.modules)
"""


def test_wrong_inputs_are_answered_before_the_solver_is_imported(tmp_path):
    (tmp_path / 'scene.yaml').write_text(SCENE)
    for name in ('bag.mcap', 'mine.png'):
        (tmp_path / name).write_bytes(b'x')
    (tmp_path / 'tables').mkdir()
    for name, text in TABLES.items():
        (tmp_path / 'tables' / name).write_text(text)
    given = json.dumps([arguments for arguments, _ in WRONG])
    result = start(ANSWERS, given, cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    *answers, is_imported = result.stdout.splitlines()
    expected = [[2, [f'foc_ros {arguments[0]}: {line}' for line in lines]] for arguments, lines in WRONG]
    assert [json.loads(each) for each in answers] == expected, result.stderr
    assert is_imported == 'False'


@pytest.fixture
def ends(monkeypatch):
    """Return a function that adds a command `end` with a given outcome."""

    def add(outcome):
        def end():
            if isinstance(outcome, BaseException):
                raise outcome
            for _ in range(2):
                warn('/a/\x1b[2J.mcap: not read')
            return outcome

        command_line.app.command(end, name='end')

    yield add
    del command_line.app['end']


WARNED = 'foc_ros end: /a/\\x1b[2J.mcap: not read\n'
"""Equal warnings are told once, and none controls the terminal."""


@pytest.mark.parametrize(
    ('outcome', 'code', 'line'),
    [
        (0, 0, WARNED),
        (3, 3, WARNED),
        (InputError('start', 'two\n  numbers', 'one'), 2, 'foc_ros end: start: expected two numbers, got one\n'),
        (InputError('topic', 'a name', '/\x1b[31mhand'), 2, 'foc_ros end: topic: expected a name, got /\\x1b[31mhand\n'),
        (OSError(5, 'Input/output error', 'a'), 2, "foc_ros end: [Errno 5] Input/output error: 'a'\n"),
        (KeyboardInterrupt(), 130, 'foc_ros: stopped\n'),
    ],
)
def test_exit_codes_and_what_is_told(ends, capfd, outcome, code, line):
    ends(outcome)
    assert run_program(['end']) == code
    assert capfd.readouterr() == ('', line)


LOUD = """
import sys
from foc_ros.cli import main as command_line
@command_line.app.command
def loud():
    {}
sys.exit(command_line.main(["loud"]))
"""


@pytest.mark.parametrize(('typed', 'agrees'), [('y\n', True), ('\n', False), ('', False)], ids=['yes', 'Enter', 'Ctrl-D'])
def test_a_question_at_a_terminal_is_answered_or_left(monkeypatch, typed, agrees):
    monkeypatch.setattr(sys, 'stdin', io.StringIO(typed))
    for each in (sys.stdin, sys.stdout):
        monkeypatch.setattr(each, 'isatty', lambda: True)
    assert confirm('Write it?') is agrees


FULL = '/dev/full'
A_LINE, MANY_LINES = 'print("x")', 'for _ in range(100000): print("x" * 100)'
A_TABLE = 'from foc_ros.io.terminal import show_table; show_table(("a", "b"), [("c", "d")] * 1000)'


def test_a_name_that_standard_output_cannot_show_is_escaped():
    environment = {**os.environ, 'PYTHONIOENCODING': 'ascii', 'PYTHONUTF8': '1'}
    result = start(LOUD.format('print("b\\udcff", "\u2500")'), env=environment)
    assert (result.returncode, result.stdout, result.stderr) == (0, 'b\\udcff \\u2500\n', '')


def printed_to(what, **options):
    result = start(LOUD.format(what), **{'capture_output': False, 'stderr': subprocess.PIPE, **options})
    return result.returncode, result.stderr


@pytest.mark.parametrize('what', [A_LINE, A_TABLE])
def test_a_pipe_whose_reader_has_closed_it_gives_141_and_no_traceback(what):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, 'wb') as pipe:
        assert printed_to(what, stdout=pipe) == (141, '')


@pytest.mark.skipif(not Path(FULL).exists(), reason='only Linux has a device that is always full')
def test_a_full_standard_output_gives_2_and_one_line_and_a_closed_one_changes_no_exit_code():
    with Path(FULL).open('w') as full:
        assert printed_to(MANY_LINES, stdout=full) == (2, 'foc_ros loud: [Errno 28] No space left on device\n')
    assert printed_to(A_LINE, preexec_fn=lambda: os.close(1)) == (0, '')
    assert printed_to('return 2 - sys.stdin.isatty()', preexec_fn=lambda: os.closerange(0, 3))[0] == 2


@pytest.mark.parametrize('width', ['0', '1', 'wide'])
def test_help_is_shown_in_a_terminal_of_any_width(width):
    help_of = [sys.executable, '-m', 'foc_ros', 'warm-up', '--help']
    shown = subprocess.run(help_of, env={**os.environ, 'COLUMNS': width}, capture_output=True, timeout=20, check=False, text=True)
    assert (shown.returncode, shown.stderr) == (0, '') and 'Do nothing' in ' '.join(shown.stdout.split())


def test_a_wide_table_is_divided_and_loses_nothing(capsys):
    columns = ['rule', *(f'column {number} of a wide table' for number in range(7)), 'last']
    rows = [[f'rule {row}', *(f'{row}.{number} (1 to 2)' for number in range(7)), f'end {row}'] for row in range(3)]
    show_table(columns, rows, 'title')
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= COLUMNS
    assert all(printed.count(text) == 1 for text in ('title', *columns[1:], *(cell for row in rows for cell in row[1:])))
    assert printed.count('rule 2') == 4


def test_names_in_the_first_column_are_whole_beside_long_texts_in_the_last(capsys):
    name, text = 'estimator.acceleration_time_s', 'not determined: no other value tried is better by more than chance'
    show_table(('parameter', 'given', 'fitted', '95 %', 'data'), [(name, '0.02', 'kept', '0.000138 to 0.000147', text)])
    printed = capsys.readouterr().out
    assert name in printed and all(word in printed for word in text.split())


def test_progress_is_printed_at_times_where_there_is_no_terminal_also_while_nothing_is_done(monkeypatch, capsys):
    monkeypatch.setattr(terminal, 'QUIET_S', 60.0)
    assert list(terminal.show_progress('ab', 'replay', 2)) == ['a', 'b'] and capsys.readouterr().err == ''
    assert list(terminal.show_progress('ab', 'stage 1 of 2', 2, is_stage=True)) == ['a', 'b']
    assert capsys.readouterr().err == 'stage 1 of 2, 0 s: 2 of 2\n'
    monkeypatch.setattr(terminal, 'QUIET_S', 0.01)
    for _ in terminal.show_progress('a', 'replay', 2, itertools.count(1).__next__):
        time.sleep(0.2)
    assert capsys.readouterr().err.splitlines()[:2] == [f'replay, 0 s, {made} predictions: 1 of 2' for made in (1, 2)]
