# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What else leads to an installation or checks one: pixi, the workflow, templates and hooks, in agreement with setup.py."""

from __future__ import annotations

import re
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import yaml
from test_optional_packages import read_requirements

import foc_ros

ROOT = Path(__file__).parents[1]
PIXI = tomllib.loads((ROOT / 'pixi.toml').read_text('utf-8'))
CONDA = {'matplotlib-base': 'matplotlib'}
"""Packages whose names on conda-forge differ."""


def read_yaml(name: str) -> Any:
    return yaml.safe_load((ROOT / name).read_text('utf-8'))


def test_pixi_names_the_package_the_channels_and_the_platforms() -> None:
    workspace, package = PIXI['workspace'], ET.parse(ROOT / 'package.xml').getroot()
    assert {key: workspace[key] for key in ('name', 'version', 'license', 'description')} == {
        key: package.findtext(key) for key in ('name', 'version', 'license', 'description')
    }
    assert workspace['version'] == foc_ros.__version__
    assert workspace['channels'] == ['robostack-jazzy', 'conda-forge'], 'RoboStack has to come first'
    assert workspace['platforms'] == ['linux-64', 'linux-aarch64', 'osx-arm64']


def test_pixi_has_every_ros_package_of_package_xml() -> None:
    keys = {node.text for node in ET.parse(ROOT / 'package.xml').getroot().findall('exec_depend')}
    wanted = {f'ros-jazzy-{key.replace("_", "-")}' for key in keys if not key.startswith('python3-')}
    found = {name for name in PIXI['dependencies'] if name.startswith('ros-jazzy-')}
    assert wanted <= found
    assert {name for name in found - wanted if not name.startswith('ros-jazzy-ros2')} == set(), 'not a command line of ROS'


def test_pixi_has_the_python_packages_of_setup_py() -> None:
    """Those of conda-forge are requirements with the same bounds; all others are installed with foc_ros itself."""
    text = (ROOT / 'setup.py').read_text('utf-8')
    bounds = {name.lower(): bound for name, bound in re.findall(r"'([\w-]+)(>=[\d.]+)'", text)}
    (package,) = PIXI['pypi-dependencies'].values()
    assert package['path'] == '.' and not package.get('editable'), 'ros2 run finds nothing in an editable installation'
    required = read_requirements()
    names = required[''].union(*(required[extra] for extra in package['extras']))
    for name, bound in PIXI['dependencies'].items():
        if name == 'python':
            assert f"python_requires='{bound}'" in text
        elif not name.startswith('ros-'):
            assert CONDA.get(name, name) in names
            assert bound == bounds[CONDA.get(name, name)], name


def test_the_tasks_of_pixi_are_commands() -> None:
    from foc_ros.cli.main import list_commands

    for task in PIXI['tasks'].values():
        program, command = task.split()
        assert program == 'foc_ros' and command in list_commands()
    launch = PIXI['feature']['rviz']['tasks']['show'].split()
    assert launch[:3] == ['ros2', 'launch', 'foc_ros'] and (ROOT / 'launch' / launch[3]).exists()


def test_the_workflow_runs_what_decides_over_a_change() -> None:
    jobs = read_yaml('.github/workflows/ci.yml')['jobs']
    assert {'run': '.ci/run'} in jobs['all']['steps']
    assert (ROOT / '.ci' / 'run').stat().st_mode & 0o111
    image = re.fullmatch(r'python:(3\.\d+)-\w+', jobs['all']['container'])
    versions = {image[1], *jobs['check']['strategy']['matrix']['python']}
    setup = (ROOT / 'setup.py').read_text('utf-8')
    assert versions == set(re.search(r'for version in \((.*?)\)', setup)[1].replace("'", '').split(', '))
    first, *_, last = sorted(versions)
    assert f'Python {first} to {last}' in (ROOT / 'Makefile').read_text('utf-8')


@pytest.mark.parametrize('name', ['bug', 'wish'])
def test_a_template_of_an_issue_asks_for_something(name: str) -> None:
    form = read_yaml(f'.github/ISSUE_TEMPLATE/{name}.yml')
    assert form['name'] and form['description']
    fields = [field for field in form['body'] if field['type'] != 'markdown']
    assert any(field.get('validations', {}).get('required') for field in fields)
    assert len({field['id'] for field in fields}) == len(fields)


def test_the_hooks_are_those_of_make_lint() -> None:
    (repository,) = read_yaml('.pre-commit-config.yaml')['repos']
    assert repository['repo'] == 'local'
    hooks = {hook['entry'].replace(' --force-exclude', '') for hook in repository['hooks']}
    recipe = re.search(r'^lint:.*\n((?:\t.*\n)+)', (ROOT / 'Makefile').read_text('utf-8'), re.MULTILINE)[1]
    assert hooks == {line.strip().replace('$(BIN)', '.venv/bin') for line in recipe.splitlines()}
