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


COMMENTED = ('py', 'sh', 'js', 'css', 'html', 'yml', 'yaml', 'toml', 'cfg', 'xml', 'rviz', 'cff', 'gitignore', 'dockerignore')
WITH_LICENCE = [*(f'*.{suffix}' for suffix in COMMENTED), 'Makefile', 'Dockerfile', '.ci', 'scripts']


def test_every_source_names_its_licence():
    """All files that may have comments; those of doc/examples are data of users."""
    for line in ('SPDX-FileCopyrightText: 2026 the foc_ros developers', 'SPDX-License-Identifier: Apache-2.0'):
        search = ['git', 'grep', '--files-without-match', line, '--', *WITH_LICENCE, ':!doc/examples/']
        found = subprocess.run(search, cwd=ROOT, capture_output=True, text=True, check=False)
        if found.returncode > 1:
            pytest.skip('not a git checkout: the list of files is unknown')
        assert found.stdout == '', f'without {line}'


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
