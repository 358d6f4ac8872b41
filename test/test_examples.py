# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every example runs and makes a figure, and the Python code on the pages does what the pages say; the numbers of the paper."""

import json
import re
import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

import matplotlib as mpl
import trials
from checks import check_trends
from paper import perform
from plan_recovery import Movement, interpolate_plan, plan, recover
from studies import PAPER_ETA, QUICK, RatioCurve

import foc_ros
from foc_ros import Status

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / 'examples').glob('*.py'))
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'doc').glob('*.md'))]
SLOW = (
    '03_likelihood_over_eta', '04_strategies', '07_monte_carlo', '08_replay_bag', '09_custom_strategy',
    '10_obstacle_source', '11_many_scenes', '14_blended_command', '15_cartesian_impedance',
)  # fmt: skip
"""They take more than a second: `make doc`, which runs all examples, is their only test."""
EXAMPLE_S = 280
"""Time limit: an example takes seconds, the studies of the paper half a minute, and both minutes on a busy machine."""
pytestmark = pytest.mark.timeout(EXAMPLE_S)


def python_blocks(page):
    """Return the blocks of Python code of a page, in their order."""
    return re.findall(r'^```python\n(.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL)


@pytest.fixture
def pyplot(monkeypatch, tmp_path, registries):
    """Figures are kept and not shown; the registries are as before afterwards."""
    monkeypatch.setenv('MPLBACKEND', 'Agg')
    mpl.use('Agg')
    import matplotlib.pyplot as plt

    monkeypatch.setattr(plt, 'show', lambda: None)
    monkeypatch.chdir(tmp_path)
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


@pytest.mark.parametrize('example', [each for each in EXAMPLES if not each.stem.endswith(SLOW)], ids=lambda example: example.stem)
def test_the_example_runs_and_makes_a_figure(example, pyplot):
    runpy.run_path(str(example), run_name='__main__')
    assert pyplot.get_fignums(), f'{example.name} makes no figure'


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


EXAMPLE = Path(__file__).resolve().parents[1] / 'examples' / 'paper'
FILES = {f'study{number}.{suffix}' for number in range(1, 8) for suffix in ('png', 'pdf')} | {'numbers.json', 'table.md'}


@pytest.fixture(scope='module')
def output(tmp_path_factory):
    return tmp_path_factory.mktemp('paper') / 'new' / 'output'


@pytest.fixture(scope='module')
def found(output):
    """Compute all studies on the coarse grid, from end to end."""
    return perform(output, QUICK)


def ratio(found, number):
    """Return the continuous ratio of a study, solved at every eta."""
    first = found[number].ratios[0]
    for curve in (first.numerator, first.denominator):
        assert {each.status for each in curve.solutions} == {Status.SOLVED}, curve.name
    return first


def test_every_trend_is_checked_and_holds(found):
    checked = check_trends(found)
    assert [each.study for each in checked] == [1, 2, 3, 4, 5, 6, 7]
    assert [each.study for each in checked if not each.holds] == []


def test_a_missing_trend_is_reported(found):
    """Where the numbers of H1 and H2, and of LV and HC, are exchanged, no statement about them holds."""
    changed = dict(found)
    for number in (3, 4, 5):
        first = found[number].ratios[0]
        swapped = RatioCurve(first.name, first.denominator, first.numerator)
        changed[number] = replace(found[number], ratios=(swapped, *found[number].ratios[1:]))
    checked = check_trends(changed)
    assert {3, 4, 5} <= {each.study for each in checked if not each.holds}


def test_files_hold_the_computed_numbers(found, output):
    assert {file.name for file in output.iterdir()} == FILES
    numbers = json.loads((output / 'numbers.json').read_text('utf-8'))
    for name, number, paper in (('LV', 5, 0.33), ('HC', 6, 0.67)):
        pair = numbers['ratio_at_eta_0.9615'][name]
        assert pair == {'paper': paper, 'ours': pytest.approx(ratio(found, number).at(PAPER_ETA), rel=1e-5)}
    assert numbers['studies'][2]['ratios'][0]['ratio'] == pytest.approx(list(ratio(found, 3).values), rel=1e-5)
    lines = (output / 'table.md').read_text('utf-8').splitlines()
    assert len(lines) == 2 + 7
    assert f'{ratio(found, 5).at(PAPER_ETA):.2f} at 0.9615' in lines[6] and '0.33 at 0.9615' in lines[6]


def test_output_that_cannot_be_written_exits_2_before_anything_is_computed(tmp_path):
    file = tmp_path / 'file'
    file.write_text('mine', encoding='utf-8')
    command = [sys.executable, str(EXAMPLE / 'paper.py'), '--output', str(file)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False, cwd=EXAMPLE.parents[1])
    assert (result.returncode, result.stdout) == (2, '')
    assert result.stderr == f'paper: --output: expected a folder that can be written, got {file}: File exists\n'
    assert file.read_text(encoding='utf-8') == 'mine'


def test_recovered_from_mean_trajectories_with_1_mm_of_sensor_noise():
    """Of another seed, 1, tau comes out 15 % too large: the fixed strategy creeps along the steps."""
    tau, lam, count, found = trials.run_trial(3, repeats=1)
    assert count >= 4
    assert trials.is_recovered(tau, lam, found), (found.tau / tau, found.lam / lam)
    assert 0.7e-3 < found.stddev < 2.5e-3
    assert found.undetermined == () and max(found.log_stddev) < 0.2


def test_without_an_obstacle_lambda_is_determined_and_tau_is_not():
    config, goal, rng = trials.CONFIG, np.array([0.3, 0.0]), np.random.default_rng(5)
    times = np.arange(0.0, 1.001, 0.01)
    solution = plan(Movement(times, times[:, None] * goal, goal, ()), 1e-9, 3e6, config)
    assert solution is not None
    measured = [interpolate_plan(solution, times) + rng.normal(0.0, 1e-3, (len(times), 2)) for _ in range(4)]
    found = recover([Movement(times, each, goal, ()) for each in measured], config)
    assert 1 / 1.2 < found.lam / 3e6 < 1.2
    assert found.undetermined == ('tau',)


def test_a_movement_that_reaches_no_goal_is_rejected():
    times = np.arange(0.0, 1.0, 0.02)
    with pytest.raises(foc_ros.InputError, match=r'expected an end within 0.05 m of the goal, got 0.202 m'):
        Movement(times, times[:, None] * np.array([0.1, 0.0]), np.array([0.3, 0.0]), ())
