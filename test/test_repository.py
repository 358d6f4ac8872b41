# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The files of the repository that are not installed agree: workflow, hooks, containers, checks, and licences of sources."""

import json
import re
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]


def test_the_workflow_runs_what_decides_over_a_change():
    jobs = yaml.safe_load((ROOT / '.github' / 'workflows' / 'ci.yml').read_text('utf-8'))['jobs']
    assert {'run': '.ci/run'} in jobs['all']['steps']
    assert (ROOT / '.ci' / 'run').stat().st_mode & 0o111
    image = re.fullmatch(r'python:(3\.\d+)-\w+', jobs['all']['container'])
    versions = {image[1], *jobs['check']['strategy']['matrix']['python']}
    setup = (ROOT / 'setup.py').read_text('utf-8')
    assert versions == set(re.search(r'for version in \((.*?)\)', setup)[1].replace("'", '').split(', '))
    first, *_, last = sorted(versions)
    assert f'Python {first} to {last}' in (ROOT / 'Makefile').read_text('utf-8')


def test_the_hooks_are_those_of_make_lint():
    (repository,) = yaml.safe_load((ROOT / '.pre-commit-config.yaml').read_text('utf-8'))['repos']
    assert repository['repo'] == 'local'
    hooks = {hook['entry'].replace(' --force-exclude', '') for hook in repository['hooks']}
    recipe = re.search(r'^lint:.*\n((?:\t.*\n)+)', (ROOT / 'Makefile').read_text('utf-8'), re.MULTILINE)[1]
    assert hooks == {line.strip().replace('$(BIN)', '.venv/bin') for line in recipe.splitlines()}


COMMANDS = ['make setup', 'make demo']


def test_readme_image_and_development_container_start_the_demo_by_the_same_two_commands():
    section = (ROOT / 'README.md').read_text('utf-8').partition('## Try it')[2]
    assert re.search(r'```console\n(.*?)```', section, re.DOTALL).group(1).splitlines() == COMMANDS
    container = json.loads((ROOT / '.devcontainer' / 'devcontainer.json').read_text('utf-8'))
    assert [container['postCreateCommand'], container['postAttachCommand']] == COMMANDS
    assert re.fullmatch(r'mcr\.microsoft\.com/devcontainers/python:3\.1[12]-bookworm', container['image'])
    dockerfile_parse = pytest.importorskip('dockerfile_parse', reason='dockerfile-parse is not installed')
    parser = dockerfile_parse.DockerfileParser(str(ROOT / 'Dockerfile'), cache_content=True, env_replace=False)
    instructions = [each for each in parser.structure if each['instruction'] != 'COMMENT']
    assert [each['instruction'] for each in instructions] == ['FROM', 'RUN', 'WORKDIR', 'COPY', 'RUN', 'CMD']
    assert re.fullmatch(r'python:3\.1[12]-slim-bookworm', instructions[0]['value'])
    assert [instructions[4]['value'], ' '.join(json.loads(instructions[5]['value']))] == COMMANDS


HEADER = ['SPDX-FileCopyrightText: 2026 the foc_ros developers', 'SPDX-License-Identifier: Apache-2.0']
COMMENTS = {'.py': '#', '.sh': '#', '.js': '//', '': '#'}
"""How a comment begins, by the ending of the file; without one, only what begins with `#!` is a source."""


def list_sources():
    """Return the sources that git knows; a link to another file is none."""
    listed = subprocess.run(['git', 'ls-files', '-z', '--cached'], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip('not a git checkout: the list of files is unknown')
    files = [ROOT / name for name in listed.stdout.split('\0') if name]
    files = [file for file in files if file.suffix in COMMENTS and file.is_file() and not file.is_symlink()]
    return [file for file in files if file.suffix or file.read_bytes()[:2] == b'#!']


def test_every_source_begins_with_its_licence():
    sources = list_sources()
    assert {'setup.py', 'run', 'player.js', 'colcon_check', '__main__.py'} <= {file.name for file in sources}
    for file in sources:
        lines = [line for line in file.read_text('utf-8').splitlines()[:3] if not line.startswith('#!')]
        header = [f'{COMMENTS[file.suffix]} {line}' for line in HEADER]
        assert lines[:2] == header, f'{file.relative_to(ROOT)} does not begin with {HEADER}'


def test_the_checks_with_ros_name_tests_that_exist():
    for script in ('colcon_check', 'tf2_check'):
        text = (ROOT / 'scripts' / script).read_text('utf-8')
        names = [
            name
            for braces, name in re.findall(r'test/test_(?:\{([\w,]+)\}|(\w+))\.py', text)
            for name in (braces or name).split(',')
        ]
        assert names, script
        assert [name for name in names if not (ROOT / 'test' / f'test_{name}.py').is_file()] == [], script
