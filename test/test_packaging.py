# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What pip and colcon install: consistent metadata, and every file that the program needs."""

import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ET
import zipfile
from email.parser import HeaderParser
from pathlib import Path

import pytest
import yaml
from test_optional_packages import read_requirements

import foc_ros
from foc_ros.cli.main import list_commands
from foc_ros.io.topics import OPTIONAL, TYPES

ROOT = Path(__file__).parents[1]
SKIPPED = shutil.ignore_patterns('.*', '__pycache__', 'build', 'dist', 'install', 'log', '*_output', '*.egg-info')
SOURCES = ('.py', '.mcap', '.css', '.html', '.js')


@pytest.fixture(scope='module')
def wheel(tmp_path_factory):
    """Build a wheel from a copy of the sources, without network access."""
    setuptools = pytest.importorskip('setuptools', '70.1', reason='setuptools 70.1 is needed to build a wheel')
    source, target = tmp_path_factory.mktemp('source') / 'foc_ros', tmp_path_factory.mktemp('wheel')
    shutil.copytree(ROOT, source, ignore=SKIPPED)
    pip = [sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-build-isolation', '--no-index']
    result = subprocess.run([*pip, '--wheel-dir', target, source], capture_output=True, text=True, timeout=100, check=False)
    assert result.returncode == 0, f'setuptools {setuptools.__version__}: {result.stderr}'
    return zipfile.ZipFile(next(target.glob('*.whl')))


@pytest.fixture(scope='module')
def package_xml():
    return ET.parse(ROOT / 'package.xml').getroot()


def test_package_xml_agrees_with_the_wheel(package_xml, wheel):
    metadata = HeaderParser().parsestr(wheel.read(next(n for n in wheel.namelist() if n.endswith('/METADATA'))).decode())
    text = {child.tag: child.text for child in package_xml}
    assert package_xml.get('format') == '3'
    assert text['name'] == metadata['Name'] == ROOT.joinpath('resource', 'foc_ros').name
    assert text['version'] == metadata['Version'] == foc_ros.__version__
    assert yaml.safe_load((ROOT / 'CITATION.cff').read_text('utf-8'))['version'] == foc_ros.__version__
    assert f'`foc_ros {foc_ros.__version__}`' in (ROOT / 'README.md').read_text('utf-8')
    assert f'\n{foc_ros.__version__} (' in (ROOT / 'CHANGELOG.rst').read_text('utf-8')
    assert text['license'] == metadata['License'] == 'Apache-2.0'
    assert text['description'] == metadata['Summary']
    assert package_xml.find('maintainer').get('email') == metadata['Maintainer-email']
    assert package_xml.findtext('export/build_type') == 'ament_python'


def test_package_xml_names_every_message_package_and_the_keys_of_rosdep(package_xml):
    keys = {node.text for node in package_xml.findall('exec_depend')}
    used = set()
    for file in (ROOT / 'foc_ros').rglob('*.py'):
        used |= set(re.findall(r"""(?:from |import |['"])(\w+_msgs|std_srvs|rcl_interfaces)[./]""", file.read_text('utf-8')))
    assert {'sensor_msgs', 'geometry_msgs', 'std_srvs'} <= used
    optional = {TYPES[role].partition('/')[0] for role in OPTIONAL}
    assert used - {'builtin_interfaces'} - optional <= keys
    every = {node.text for node in package_xml if node.tag.endswith('depend')}
    by_pip = {key for key in every if key.endswith('-pip')}
    assert by_pip == {'python3-piqp-pip', 'python3-qpsolvers-pip'}, 'a build farm installs nothing by pip, and lacks these only'
    rules = yaml.safe_load((ROOT / 'rosdep' / 'foc_ros.yaml').read_text('utf-8'))
    assert set(rules) <= every
    assert rules['python3-piqp-pip']['ubuntu'] == {'pip': {'packages': ['piqp']}}


def test_wheel_contains_all_files_of_the_program(wheel):
    names = set(wheel.namelist())
    data = f'foc_ros-{foc_ros.__version__}.data/data/'
    assert f'{data}share/ament_index/resource_index/packages/foc_ros' in names
    assert f'{data}share/foc_ros/package.xml' in names
    for name in ('foc.yaml', 'foc.rviz', 'foxglove.json', 'sros2_policy.xml'):
        assert f'{data}share/foc_ros/config/{name}' in names
    for file in (ROOT / 'launch').iterdir():
        assert f'{data}share/foc_ros/launch/{file.name}' in names
    sources = {path.relative_to(ROOT).as_posix() for path in (ROOT / 'foc_ros').rglob('*') if path.suffix in SOURCES}
    assert 'foc_ros/recordings/reaching.mcap' in sources
    assert sources <= names, sources - names
    assert not [name for name in names if name.startswith(('test', 'scripts', 'benchmarks'))]


def test_ros2_run_finds_every_command(wheel):
    """`ros2 run` starts files of lib/foc_ros: one executable per command, which is not on PATH."""
    scripts = {Path(info.filename).name: info for info in wheel.infolist() if '.data/data/lib/foc_ros/' in info.filename}
    assert set(scripts) == {*list_commands(), 'foc_node'}
    assert all(info.external_attr >> 16 & 0o111 == 0o111 for info in scripts.values())
    entry_points = wheel.read(next(n for n in wheel.namelist() if n.endswith('/entry_points.txt'))).decode()
    assert re.findall(r'^(\w+) =', entry_points, re.MULTILINE) == ['foc_node', 'foc_ros']


@pytest.mark.parametrize('script', sorted((ROOT / 'scripts' / 'ros2_run').iterdir()), ids=lambda script: script.name)
def test_ros2_run_starts_the_command(script, monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', [str(script), '--help'])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(script), run_name='__main__')
    assert not ended.value.code
    assert f'Usage: foc_ros {script.name.replace("foc_node", "node")}' in capsys.readouterr().out


def test_an_executable_runs_in_the_python_of_its_environment(tmp_path):
    """`lib/foc_ros` of a virtual environment that is not activated; without a Python in the environment, that of the PATH."""
    script, interpreter = tmp_path / 'lib' / 'foc_ros' / 'foc_node', tmp_path / 'bin' / 'python3'
    for each in (script, interpreter):
        each.parent.mkdir(parents=True)
    shutil.copy(ROOT / 'scripts' / 'ros2_run' / 'foc_node', script)
    interpreter.write_text('#!/bin/sh\necho "$@"\n')
    interpreter.chmod(0o755)
    command = [sys.executable, script, '--ros-args']
    result = subprocess.run(command, capture_output=True, text=True, timeout=100, check=True)
    assert result.stdout == f'{script} --ros-args\n'


def test_no_file_contains_a_path_of_one_machine():
    listed = subprocess.run(['git', 'ls-files', '-z'], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode:
        pytest.skip('not a git checkout: the list of files is unknown')
    wrong = re.compile(rb'/(?:home|root|Users|work)/\w')
    for name in filter(None, listed.stdout.decode().split('\0')):
        file = ROOT / name
        if file.is_file() and file.suffix not in ('.png', '.mcap') and file != Path(__file__):
            assert not wrong.search(file.read_bytes()), f'{name} contains a path of one machine'


PIXI = tomllib.loads((ROOT / 'pixi.toml').read_text('utf-8'))
CONDA = {'matplotlib-base': 'matplotlib'}
"""Packages whose names on conda-forge differ."""


def test_pixi_names_the_package_installs_what_package_xml_and_setup_py_name_and_has_commands_as_tasks(package_xml):
    """Python packages of conda-forge are requirements with the same bounds; all others are installed with foc_ros itself."""
    workspace, keys = PIXI['workspace'], {node.text for node in package_xml.findall('exec_depend')}
    assert all(workspace[key] == package_xml.findtext(key) for key in ('name', 'version', 'license', 'description'))
    assert workspace['channels'] == ['robostack-jazzy', 'conda-forge'], 'RoboStack has to come first'
    wanted = {f'ros-jazzy-{key.replace("_", "-")}' for key in keys if not key.startswith('python3-')}
    found = {name for name in PIXI['dependencies'] if name.startswith('ros-jazzy-')}
    assert wanted <= found
    assert all(name.startswith('ros-jazzy-ros2') for name in found - wanted), 'not a command line of ROS'
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
    commands = [task.split() for task in PIXI['tasks'].values()]
    assert all(program == 'foc_ros' and command in list_commands() for program, command in commands)
    launch = PIXI['feature']['rviz']['tasks']['show'].split()
    assert launch[:3] == ['ros2', 'launch', 'foc_ros'] and (ROOT / 'launch' / launch[3]).exists()


@pytest.fixture
def clone(tmp_path):
    """Return a folder with the files that `make setup` reads."""
    if shutil.which('make') is None:
        pytest.skip('make is not installed')
    folder = tmp_path / 'clone'
    folder.mkdir()
    for name in ('Makefile', 'setup.py', 'setup.cfg', 'pyproject.toml'):
        shutil.copy(ROOT / name, folder)
    return folder


def make(clone, *arguments, path=None):
    """Run make; path: a folder in which programs are found first."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(('MAKE', 'MFLAGS', 'VIRTUAL_ENV'))}
    environment['PATH'] = os.pathsep.join([*([] if path is None else [str(path)]), environment['PATH']])
    command = ['make', '--no-print-directory', *arguments]
    return subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True, timeout=100, check=False)


SHIM = 'is a shim of pyenv, and no active version has it; activate one that has: pyenv shell 3.99.1'


@pytest.mark.parametrize(
    ('name', 'program', 'words'),
    [
        ('no_such_python', None, 'there is no no_such_python; choose another, as in make setup PYTHON=python3.12\n'),
        ('python3.99', 'exit 127', f'python3.99 {SHIM}\n'),
        (
            'python3',
            'case "$*" in *version_info*) exit 1;; -V) echo Python 3.10.2;; esac',
            'foc_ros needs Python 3.11 to 3.14, and ',
        ),
    ],
    ids=['not there', 'inactive shim of pyenv', 'old'],
)
def test_a_python_that_cannot_be_used_is_named_before_anything_is_made(clone, tmp_path, name, program, words):
    programs = {'pyenv': 'echo 3.99.1'} | ({} if program is None else {name: program})
    (tmp_path / 'shims').mkdir()
    for each, text in programs.items():
        (tmp_path / 'shims' / each).write_text(f'#!/bin/sh\n{text}\n')
        (tmp_path / 'shims' / each).chmod(0o755)
    result = make(clone, 'setup', f'PYTHON={name}', path=tmp_path / 'shims')
    assert result.returncode != 0 and f'make: {words}' in result.stderr
    assert not (clone / '.venv').exists()


def test_setup_says_what_it_does_and_linters_and_peers_are_installed_by_their_targets_only(clone):
    recipes = {target: make(clone, '--dry-run', target).stdout for target in ('setup', 'lint', 'doc', 'bench')}
    told = re.findall(r'echo [\'"]setup: (\w+)', recipes['setup'])
    assert told == ['creating', 'installing', 'ready'] and 'ready; next: make demo' in recipes['setup']
    setup = 'ros,report,play,test'
    extras = {target: re.findall(r"'(?:\.|foc_ros)\[([\w,]+)\]'", recipe) for target, recipe in recipes.items()}
    assert extras == {'setup': [setup], 'lint': [setup, 'lint'], 'doc': [setup, 'doc'], 'bench': [setup, 'bench']}


def test_tests_that_share_a_fixture_run_in_one_worker(request, package_xml):
    """pytest-xdist finds a group by the name of its tests, and without a word it does not with a pytest that it does not know."""
    is_grouped = getattr(request.config.option, 'loadgroup', False)
    assert request.node.nodeid.endswith('@test_packaging.py') == is_grouped
