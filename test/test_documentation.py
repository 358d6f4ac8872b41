"""The documentation names only files, parameters, commands and tests that exist, and the start page leads to every page."""

import ast
import re
from pathlib import Path

import pytest
import yaml

from foc_ros.cli.main import list_commands
from foc_ros.core.config import list_parameters

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'doc').glob('**/*.md')])
TESTS = {
    f'{file.name}::{node.name}'
    for file in (ROOT / 'test').glob('test_*.py')
    for node in ast.walk(ast.parse(file.read_text('utf-8')))
    if isinstance(node, ast.FunctionDef) and node.name.startswith('test_')
}


def find_anchors(page: Path) -> set[str]:
    """Return the anchors that repositories give to the headings of a page."""
    headings = re.findall(r'^#+ (.+)$', page.read_text('utf-8'), re.MULTILINE)
    return {re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r'\]\(([^)\s]+)\)', page.read_text('utf-8')):
        path, _, anchor = target.partition('#')
        if '://' in target:
            continue
        linked = page.parent / path if path else page
        assert linked.exists(), f'{page.name}: {target} does not exist'
        assert not anchor or anchor in find_anchors(linked), f'{page.name}: {target} has no such heading'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_paths_named_exist(page: Path) -> None:
    """Module paths, scripts and tests in code font are those of this tree."""
    text = page.read_text('utf-8')
    for path in re.findall(r'`((?:foc_ros|scripts|test|examples|benchmarks|config|rosdep)/[\w/.]*)`', text):
        assert (ROOT / path).exists(), f'{page.name}: there is no {path}'


def test_every_page_is_in_the_table_of_contents() -> None:
    contents = (ROOT / 'doc' / 'index.md').read_text('utf-8')
    listed = set(re.findall(r'^(\w+)$', contents, re.MULTILINE))
    pages = {page.stem for page in (ROOT / 'doc').glob('*.md')} - {'index'}
    assert pages <= listed, f'doc/index.md does not list {pages - listed}'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_parameters_named_exist(page: Path) -> None:
    known = {parameter.name for parameter in list_parameters()}
    groups = '|'.join(sorted({name.partition('.')[0] for name in known if '.' in name}))
    for name in re.findall(rf'`((?:{groups})\.(?!py`)\w+)`', page.read_text('utf-8')):
        assert name in known, f'{page.name}: there is no parameter {name}'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_commands_named_exist(page: Path) -> None:
    text = page.read_text('utf-8')
    shown = '\n'.join([*re.findall(r'^```console\n(.*?)^```', text, re.MULTILINE | re.DOTALL), *re.findall(r'`([^`\n]+)`', text)])
    for command in re.findall(r'(?:^|[/ ])foc_ros ([a-z][\w-]*)(?![\w.])', shown, re.MULTILINE):
        assert command in {*list_commands(), 'foc_node'}, f'{page.name}: there is no command {command}'


def test_every_command_is_documented() -> None:
    text = (ROOT / 'doc' / 'interfaces.md').read_text('utf-8')
    for command in list_commands():
        assert re.search(rf'^\| `{command}\b', text, re.MULTILINE), f'doc/interfaces.md does not list {command}'


def test_failures_are_tested_as_they_say() -> None:
    """Every row of doc/failures.md has tests, and they exist."""
    lines = (ROOT / 'doc' / 'failures.md').read_text('utf-8').splitlines()
    rows = [line[2:].partition(' | ')[0] for line in lines if re.match(r'\| (?!when|-)', line)]
    named_tests = yaml.safe_load((ROOT / 'test' / 'failure_tests.yaml').read_text('utf-8'))
    assert rows == list(named_tests)
    for row, names in named_tests.items():
        assert names and not set(names) - TESTS, f'{row}: no such test: {set(names) - TESTS}'


def test_troubleshooting_quotes_texts_that_exist() -> None:
    """What the page quotes in its first column is in the sources, perhaps with a value between."""
    lines = (ROOT / 'doc' / 'troubleshooting.md').read_text('utf-8').splitlines()
    quoted = [text for line in lines if line.startswith('| ') for text in re.findall(r'`([^`]+)`', line.split(' | ')[0])]
    sources = [ROOT / 'Makefile', *(ROOT / 'foc_ros').rglob('*.py')]
    text = '\n'.join(file.read_text('utf-8') for file in sources)
    composed = {'hand_wrong_frame', 'obstacles_wrong_frame', 'goals_wrong_frame', 'scene_goal_inside', 'scene_no_way'}
    assert len(quoted) > 20 and composed <= set(quoted)
    for each in quoted:
        wanted = each.partition('_')[2] if each in composed else each
        assert wanted in text, f'no source has the text {each}'


def test_failures_of_the_node_name_the_level_of_its_diagnostics() -> None:
    sections = (ROOT / 'doc' / 'failures.md').read_text('utf-8').split('\n## ')[1:]
    node_sections = [section for section in sections if not section.startswith('Files')]
    assert len(node_sections) == 4
    for section in node_sections:
        header, _, *rows = [line for line in section.splitlines() if line.startswith('|')]
        assert header == '| when | what happens | level | where you see it |'
        for row in rows:
            level = row.split(' | ')[2]
            assert re.match(r'(OK|WARN|ERROR|unchanged|none)\b', level), row
