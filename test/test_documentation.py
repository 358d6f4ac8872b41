# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation names only what exists, the start page leads to every page, and its command lines work as they stand."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml
from tiers import LONG, PROCESS, is_listed, list_test_functions

from foc_ros.cli.main import list_commands
from foc_ros.core.config import list_parameters
from foc_ros.ros.isolated_node import reserve_domain

ROOT = Path(__file__).parents[1]
SHOWN_PAGES = sorted([ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *(ROOT / 'doc').glob('*.md')])
"""Every line of a block marked `console` runs as it stands, page by page and in order, unless a pattern of NOT_RUN matches."""

NOT_RUN = {
    'make *': '.ci/run runs those that decide over a change; bench, people, stress and demo take minutes',
    '.ci/run': 'it runs this test',
    'scripts/tf2_check': 'clones and compiles tf2; run it before a release',
    '.venv/bin/python *': 'takes minutes; test_benchmarks.py measures a part',
    'echo "yaml *| sudo tee *': 'needs root',
    'rosdep *': 'needs root or the network',
    'colcon build *': 'scripts/colcon_check runs this line',
    'source install/setup.bash': 'scripts/colcon_check runs this line',
    'python3 -m venv *': 'needs the network',
    'pip install *': 'needs the network',
    'export *': 'the environment of the test has it, or it is for the commands of a ROS installation',
    '. .venv/bin/activate': 'the program is on the path of the test already',
    'ros2 *': 'needs a ROS installation; test_launch.py, test_node_process.py and scripts/colcon_check do the same',
    'foc_ros evaluate *': 'takes minutes; test_evaluate.py runs it with few predictions',
    'foc_ros fit *': 'takes minutes; test_fit.py runs it with few predictions',
    'foc_ros node --ros-args --params-file operator.yaml': 'needs the output of a fit',
    'foc_ros play': 'runs until it is stopped, on a fixed port; test_play_browser.py starts it on a free one',
    'foc_ros simulate *': 'takes minutes; test_simulation.py runs a part',
}
ENDLESS = 'foc_ros node *[!&]', 'python doc/examples/teleoperation_loop.py'
"""Lines that run until they are interrupted."""
KNOWN_BLOCKS = {'console', 'python', 'yaml', 'text', '{toctree}', '{eval-rst}'}


def find_commands(page: Path) -> Iterator[str]:
    """Yield the command lines of a page; continued lines are joined, comments are removed."""
    for block in re.findall(r'^```console\n(.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL):
        for line in re.sub(r'\s*\\\n\s*', ' ', block).splitlines():
            command = re.sub(r'(^|\s+)#.*$', '', line).strip()
            if command:
                yield command


def is_among(command: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(command, pattern) for pattern in patterns)


PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'doc').glob('**/*.md')])
TESTS = list_test_functions()


def find_anchors(page):
    """Return the anchors that repositories give to the headings of a page."""
    headings = re.findall(r'^#+ (.+)$', page.read_text('utf-8'), re.MULTILINE)
    return {re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r'\]\(([^)\s]+)\)', page.read_text('utf-8')):
        path, _, anchor = target.partition('#')
        if '://' in target:
            continue
        linked = page.parent / path if path else page
        assert linked.exists(), f'{page.name}: {target} does not exist'
        assert not anchor or anchor in find_anchors(linked), f'{page.name}: {target} has no such heading'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_what_a_page_names_exists(page):
    """Module paths, scripts and tests in code font, parameters and commands are those of this tree."""
    text = page.read_text('utf-8')
    paths = re.findall(r'`((?:foc_ros|scripts|test|examples|benchmarks|config|rosdep)/[\w/.]*)`', text)
    assert [path for path in paths if not (ROOT / path).exists()] == []
    known = {parameter.name for parameter in list_parameters()}
    groups = '|'.join(sorted({name.partition('.')[0] for name in known if '.' in name}))
    assert set(re.findall(rf'`((?:{groups})\.(?!py`)\w+)`', text)) <= known
    shown = '\n'.join([*re.findall(r'^```console\n(.*?)^```', text, re.MULTILINE | re.DOTALL), *re.findall(r'`([^`\n]+)`', text)])
    kinds = re.findall(r'^```([^\n`]*)\n(?:.*?)^```', text, re.MULTILINE | re.DOTALL)
    assert set(kinds) <= KNOWN_BLOCKS, 'a block of another kind might have commands'
    commands = re.findall(r'(?:^|[/ ])foc_ros ([a-z][\w-]*)(?![\w.])', shown, re.MULTILINE)
    assert set(commands) <= {*list_commands(), 'foc_node'}


def test_every_page_is_in_the_table_of_contents_and_every_command_is_documented():
    contents = (ROOT / 'doc' / 'index.md').read_text('utf-8')
    pages = {page.stem for page in (ROOT / 'doc').glob('*.md')} - {'index'}
    assert pages - set(re.findall(r'^(\w+)$', contents, re.MULTILINE)) == set(), 'doc/index.md does not list them'
    text = (ROOT / 'doc' / 'interfaces.md').read_text('utf-8')
    unlisted = [command for command in list_commands() if not re.search(rf'^\| `{command}\b', text, re.MULTILINE)]
    assert unlisted == [], 'doc/interfaces.md does not list them'


def read_failures():
    """Return the cells of each row of the table of failures, by the heading within the table under which it stands."""
    text = (ROOT / 'doc' / 'troubleshoot.md').read_text('utf-8').partition('\n## All failures\n')[2]
    header, _, *lines = [line for line in text.splitlines() if line.startswith('|')]
    assert header == '| case | level | what happens, what you see, what to do |'
    parts: dict[str, list[list[str]]] = {}
    for line in lines:
        cells = [cell.strip() for cell in line.rstrip()[1:-1].split(' |')]
        if cells[0].startswith('**'):
            parts[cells[0].strip('*')] = []
        else:
            parts[list(parts)[-1]].append(cells)
    return parts


UNTESTED = 'Installation', 'Predictions are not what you expect'
"""What is no failure of the program, but of its installation or of an expectation."""


def test_failures_are_tested_as_they_say():
    """Every row of the table of failures has tests, and they exist."""
    rows = [cells[0] for part, found in read_failures().items() if part not in UNTESTED for cells in found]
    named_tests = yaml.safe_load((ROOT / 'test' / 'failure_tests.yaml').read_text('utf-8'))
    assert len(rows) > 100
    assert rows == list(named_tests)
    for row, names in named_tests.items():
        assert names and not set(names) - TESTS, f'{row}: no such test: {set(names) - TESTS}'


def test_failures_quote_and_count_what_the_sources_say_and_name_the_level():
    """What the table quotes is in the sources, perhaps with values between; a count as a whole, or what follows its input."""
    text = '\n'.join(file.read_text('utf-8') for file in [ROOT / 'Makefile', *(ROOT / 'foc_ros').rglob('*.py')])
    rows = [cells for found in read_failures().values() for cells in found]
    assert all(len(cells) == 3 and re.match(r'(OK|WARN|ERROR|unchanged|none|exit \d+)\b|$', cells[1]) for cells in rows), rows
    quoted = [part for cells in rows for each in re.findall(r'"([^"]+)"', cells[-1]) for part in each.split(' ... ')]
    assert len(quoted) > 40 and [each for each in quoted if each not in text] == []
    counts = {m.groups() for cells in rows for m in re.finditer(rf'`({INPUTS}_(?:dropped_)?([a-z_]+))`', cells[-1])}
    assert len(counts) > 20
    assert [count for count, reason in counts if count not in text and not re.search(rf"['_]{reason}\b", text)] == []


INPUTS = '(?:hand_pose|hand|obstacle_markers|obstacles|collision_objects|detections|goals|predict|scene)'


def test_the_documentation_is_short():
    """A reader has an hour: README and pages together have at most 25,000 words."""
    words = {page.name: len(page.read_text('utf-8').split()) for page in [ROOT / 'README.md', *(ROOT / 'doc').glob('*.md')]}
    assert sum(words.values()) <= 25_000, words


def test_every_pattern_matches_a_test():
    functions = [name.split('::') for name in TESTS]
    patterns = LONG + PROCESS
    assert [pattern for pattern in patterns if not any(is_listed(*each, (pattern,)) for each in functions)] == []


RUN = {page: [line for line in find_commands(page) if not is_among(line, NOT_RUN)] for page in SHOWN_PAGES}
ENDLESS_S = 6
"""Time after which a line that runs until it is interrupted is interrupted."""
PAGE_S = 280
"""A page takes half a minute; this is for a busy machine."""
ROS_COMMANDS = ('foc_ros node', 'teleoperation_loop')


def test_every_pattern_is_shown_and_the_main_commands_are_run():
    shown = [line for page in SHOWN_PAGES for line in find_commands(page)]
    assert [pattern for pattern in (*NOT_RUN, *ENDLESS) if not any(is_among(line, [pattern]) for line in shown)] == []
    run = [line for lines in RUN.values() for line in lines]
    assert len(run) >= 12
    for name in ('solve', 'convert', 'replay', 'node'):
        assert any(line.startswith(f'foc_ros {name} ') for line in run), f'no {name} is shown and run'


@pytest.mark.timeout(PAGE_S + 20)
@pytest.mark.parametrize('page', [page for page in SHOWN_PAGES if RUN[page]], ids=lambda page: page.name)
def test_commands_work_as_shown(page, tmp_path):
    """The lines run in a clone that also contains the files that a user would bring."""
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    if any(word in line for line in RUN[page] for word in ROS_COMMANDS) and find_spec('rclpy') is None:
        pytest.skip('rclpy is not installed')
    clone = make_clone(tmp_path / 'clone')
    done = run_lines(clone, RUN[page])
    assert done.returncode == 0, f'{done.stdout}\n{done.stderr}'
    check_outputs(page.name, clone, done.stdout)


def make_clone(clone):
    clone.mkdir()
    for name in ('doc', 'config', 'scripts', 'foc_ros', 'Makefile', 'setup.py', 'test', 'pyproject.toml'):
        (clone / name).symlink_to(ROOT / name)
    (clone / '.venv' / 'bin').mkdir(parents=True)
    (clone / '.venv' / 'bin' / 'python').symlink_to(sys.executable)
    for name in ('recordings.csv', 'obstacles.csv', 'goals.csv', 'scene.yaml'):
        shutil.copy(ROOT / 'doc' / 'examples' / name, clone)
    shutil.copy(ROOT / 'config' / 'foc.yaml', clone)
    tables = ['recordings.csv', '--obstacles', 'obstacles.csv', '--goals', 'goals.csv', '--output', 'made']
    subprocess.run([sys.executable, '-m', 'foc_ros', 'convert', *tables], cwd=clone, check=True, capture_output=True)
    (clone / 'made' / 'a').rename(clone / 'my_bag')
    return clone


def run_lines(clone, lines):
    """Run the lines in one shell, with their own ROS graph, and end the processes that they leave running."""
    # 124: the line was still running when it was interrupted
    run = [
        f'code=0; timeout -s INT {ENDLESS_S} {line} || code=$?; test $code = 124' if is_among(line, ENDLESS) else line
        for line in lines
    ]
    script = '\n'.join(['set -euo pipefail', "trap 'kill $(jobs -p) 2>/dev/null || true; wait' EXIT", *run])
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    with reserve_domain() as domain:
        environment = os.environ | {'PATH': path, 'ROS_LOG_DIR': str(clone / 'log'), 'ROS_DOMAIN_ID': str(domain)}
        return subprocess.run(
            ['bash', '-c', script], cwd=clone, env=environment, capture_output=True, text=True, timeout=PAGE_S, check=False
        )


def check_outputs(page, clone, printed):
    if page in ('README.md', 'start.md'):
        numbers = json.loads((clone / 'report' / 'predictions.json').read_text('utf-8'))
        assert len(numbers['predictions']) > 20
        assert (clone / 'report' / 'index.html').exists()
        assert (clone / 'scene.png').exists()
    if page == 'start.md':
        shares = [
            int(line.rpartition(' ')[2].removesuffix('%')) for line in printed.splitlines() if 'following the prediction' in line
        ]
        assert shares and max(shares) > 10, printed
