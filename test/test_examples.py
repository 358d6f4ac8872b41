# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every example runs and makes a figure, and the Python code on the pages does what the pages say."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import foc_ros
from foc_ros.core import registry

mpl = pytest.importorskip('matplotlib', reason='matplotlib is not installed')

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / 'examples').glob('*.py'))
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'doc').glob('*.md'))]
SLOW = ('07_monte_carlo', '08_replay_bag', '09_custom_strategy', '10_obstacle_source', '11_many_scenes', '14_blended_command')
"""They take more than a second: `make doc`, which runs all examples, is their only test."""
EXAMPLE_S = 280
"""Time limit: an example takes a few seconds, and minutes on a busy machine."""


def python_blocks(page):
    """Return the blocks of Python code of a page, in their order."""
    return re.findall(r'^```python\n(.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL)


@pytest.fixture
def pyplot(monkeypatch, tmp_path):
    """Figures are kept and not shown; the registries are as before afterwards."""
    monkeypatch.setenv('MPLBACKEND', 'Agg')
    mpl.use('Agg')
    import matplotlib.pyplot as plt

    monkeypatch.setattr(plt, 'show', lambda: None)
    monkeypatch.chdir(tmp_path)
    for parts in (each for each in vars(registry).values() if isinstance(each, registry.Registry)):
        monkeypatch.setattr(parts, '_parts', dict(parts._parts))
    plt.close('all')
    yield plt
    plt.close('all')


def test_there_are_examples_with_titles():
    assert len(EXAMPLES) >= 10
    gallery = (ROOT / 'doc' / 'examples.md').read_text('utf-8')
    for example in EXAMPLES:
        docstring = re.match(r'(?:#.*\n)*"""\n(.+)\n(=+)\n\n', example.read_text('utf-8'))
        assert docstring and len(docstring[1]) == len(docstring[2]), f'{example.name} has no title'
        assert f'[{docstring[1]}](../examples/{example.name})' in gallery, f'doc/examples.md does not list {example.name}'


@pytest.mark.timeout(EXAMPLE_S)
@pytest.mark.parametrize('example', [each for each in EXAMPLES if not each.stem.endswith(SLOW)], ids=lambda example: example.stem)
def test_the_example_runs_and_makes_a_figure(example, pyplot):
    runpy.run_path(str(example), run_name='__main__')
    assert pyplot.get_fignums(), f'{example.name} makes no figure'


@pytest.mark.timeout(EXAMPLE_S)
@pytest.mark.parametrize('page', [page for page in PAGES if python_blocks(page)], ids=lambda page: page.name)
def test_the_code_on_the_page_runs(page, tmp_path):
    """All blocks of a page run in their order in one process of their own, where warnings are errors."""
    script = tmp_path / 'page.py'
    script.write_text('\n\n'.join(["import matplotlib\n\nmatplotlib.use('Agg')", *python_blocks(page)]), encoding='utf-8')
    command = [sys.executable, '-W', 'error', '-W', 'ignore::DeprecationWarning', str(script)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=EXAMPLE_S, check=False)
    assert done.returncode == 0, done.stderr


def test_the_api_reference_lists_every_public_name():
    page = (ROOT / 'doc' / 'api.md').read_text('utf-8')
    documented = set(re.findall(r'^\.\. auto\w+:: (\w+)', page, re.MULTILINE))
    assert documented == set(foc_ros.__all__)
