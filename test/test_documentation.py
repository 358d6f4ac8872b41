# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation names only files, parameters, commands and tests that exist, and the start page leads to every page."""

import re
from pathlib import Path

import pytest
import yaml
from tiers import LONG, PROCESS, is_listed, list_test_functions

from foc_ros.cli.main import list_commands
from foc_ros.core.config import list_parameters

ROOT = Path(__file__).parents[1]
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
def test_paths_named_exist(page):
    """Module paths, scripts and tests in code font are those of this tree."""
    text = page.read_text('utf-8')
    for path in re.findall(r'`((?:foc_ros|scripts|test|examples|benchmarks|config|rosdep)/[\w/.]*)`', text):
        assert (ROOT / path).exists(), f'{page.name}: there is no {path}'


def test_every_page_is_in_the_table_of_contents():
    contents = (ROOT / 'doc' / 'index.md').read_text('utf-8')
    listed = set(re.findall(r'^(\w+)$', contents, re.MULTILINE))
    pages = {page.stem for page in (ROOT / 'doc').glob('*.md')} - {'index'}
    assert pages <= listed, f'doc/index.md does not list {pages - listed}'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_parameters_named_exist(page):
    known = {parameter.name for parameter in list_parameters()}
    groups = '|'.join(sorted({name.partition('.')[0] for name in known if '.' in name}))
    for name in re.findall(rf'`((?:{groups})\.(?!py`)\w+)`', page.read_text('utf-8')):
        assert name in known, f'{page.name}: there is no parameter {name}'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_commands_named_exist(page):
    text = page.read_text('utf-8')
    shown = '\n'.join([*re.findall(r'^```console\n(.*?)^```', text, re.MULTILINE | re.DOTALL), *re.findall(r'`([^`\n]+)`', text)])
    for command in re.findall(r'(?:^|[/ ])foc_ros ([a-z][\w-]*)(?![\w.])', shown, re.MULTILINE):
        assert command in {*list_commands(), 'foc_node'}, f'{page.name}: there is no command {command}'


def test_every_command_is_documented():
    text = (ROOT / 'doc' / 'interfaces.md').read_text('utf-8')
    for command in list_commands():
        assert re.search(rf'^\| `{command}\b', text, re.MULTILINE), f'doc/interfaces.md does not list {command}'


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
