# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The closed-loop study: operators, measures, and the command."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evaluation_samples import reach, write_tables

from foc_ros.analysis.simulation import OPERATORS, UNANNOUNCED_GOAL
from foc_ros.analysis.simulation.operators import DT, Arm, Task, draw_task, interpolate_minimum_jerk
from foc_ros.analysis.simulation.study import Assistance, Trial, make_pairs, measure_trial, run_pair
from foc_ros.cli.main import main
from foc_ros.core.config import Config
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.ros.parameters import dump_parameter_file

GOALS = np.array([[0.3, 0.1], [0.3, -0.1]])
QUICK = Config(budget_s=0.0).with_values({'foc.steps': 20, 'homotopy.max_candidates': 2, 'rate_hz': 10.0})


@pytest.mark.parametrize('operator', OPERATORS[:-1])
def test_operators_intend_what_their_names_say(operator):
    task = draw_task(operator, np.random.default_rng(4))
    assert np.hypot(*(task.path[:, 0][-1] - task.goal)) < 1e-9
    is_announced = bool((np.hypot(*(task.goals - task.goal).T) < 1e-9).any())
    assert is_announced == (operator != UNANNOUNCED_GOAL) == (task.goal_row >= 0)
    jumps = np.hypot(*np.diff(task.path[:, 0], axis=0).T) / DT
    assert jumps.max() < 1.5, 'the path is continuous'


def test_measures_of_a_trial_with_known_answers():
    path = interpolate_minimum_jerk(np.array([[0.0, 0.0], GOALS[0]]), np.array([0.0, 1.2]), np.zeros((2, 2)))
    task = Task(Arm(noise=0.0), make_obstacles([(0.15, 0.05)], [0.02]), GOALS, GOALS[0], 0, path)
    position = np.linspace([0.0, 0.0], [0.3, 0.1], 101)
    direction = np.array([0.3, 0.1]) / np.hypot(0.3, 0.1)
    forces = np.tile(-2.0 * direction, (101, 1))
    trial = Trial(position, forces, np.ones((101, 2)), np.zeros(101), has_arrived=True)
    measures = measure_trial(trial, task, 4.0)
    assert (measures['arrival_rate'], measures['completion_s']) == (1.0, pytest.approx(101 * DT))
    never = measure_trial(replace(trial, has_arrived=False), task, 4.0)
    assert never['arrival_rate'] == 0.0 and np.isnan(never['completion_s']), 'the time limit is no time of arrival'
    assert measures['collision_rate'] == 1.0
    assert measures['min_clearance_m'] == pytest.approx(-0.02, abs=1e-6)
    assert measures['path_m'] == pytest.approx(np.hypot(0.3, 0.1))
    assert measures['effort'] == pytest.approx(2.0 * 101 * DT)
    assert measures['opposing_impulse'] == pytest.approx(2.0 * 100 * DT, rel=0.02)
    assert measures['opposing_share'] == pytest.approx(0.5, rel=0.02)


def run(folder, capsys, *options, config=QUICK):
    (folder / 'quick.yaml').write_text(dump_parameter_file(config))
    assert main(['simulate', '--params', str(folder / 'quick.yaml'), '--json', *options]) == 0
    return json.loads(capsys.readouterr().out)['cells']


def test_without_a_force_guidance_opposes_nothing(tmp_path, capsys):
    weak = QUICK.with_values({'guidance.f_max': 0.0})
    alone, guided = run(tmp_path, capsys, '--operators', 'accurate', '--trials', '1', '--workers', '1', config=weak)
    assert alone['opposing_share'] == guided['opposing_share'] == 0.0
    assert alone['completion_s'] == guided['completion_s'] and alone['path_m'] == guided['path_m']


def test_the_hand_of_an_operator_is_as_large_as_the_parameters_say(tmp_path, capsys):
    options = ['--operators', 'accurate', '--assistance', 'none', '--trials', '5', '--workers', '1']
    configs = [QUICK.with_values({'scene.hand_radius': radius}) for radius in (0.0, 0.012)]
    (small,), (large,) = (run(tmp_path, capsys, *options, config=each) for each in configs)
    assert large['path_m'] > small['path_m'] + 0.005, 'a larger hand makes larger detours'
    assert abs(large['min_clearance_m'] - small['min_clearance_m']) < 0.006, 'and keeps about the same distance'


class Misled(Assistance):
    """Takes a wrong way to be the likeliest, and draws back with a force [N]."""

    force: np.ndarray

    def compute_force(self, step, position, velocity, acceleration):
        self.is_wrong = True
        return self.force


@pytest.mark.parametrize('force', [0.3, 3.0])
def test_a_wrong_way_costs_what_the_operator_needs_more_than_alone_also_if_the_hand_never_arrives(force):
    ((_, pair),) = make_pairs(['noisy'], ['misled'], 1, 3)
    rule = type('Rule', (Misled,), {'force': np.array([-force, 0.0])})
    measures = run_pair(pair, QUICK, {'none': Assistance, 'misled': rule}).measures
    assert measures['misled']['arrival_rate'] == (force < 1.0)
    for harm, name in (('wrong_way_s', 'duration_s'), ('wrong_way_effort', 'effort')):
        assert measures['misled'][harm] == measures['misled'][name] - measures['none'][name] > 0.0
        assert np.isnan(measures['none'][harm])


def test_the_command_prints_equal_cells_whatever_the_workers_and_writes_a_report(tmp_path, capsys):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    options = ['--operators', 'changes_way', '--assistance', 'foc', '--trials', '1', '--seed', '7']
    cells = run(tmp_path, capsys, *options, '--workers', '1', '--report', str(tmp_path))
    assert cells == run(tmp_path, capsys, *options, '--workers', '2')
    kinds = [(cell['operator'], cell['assistance'], cell['trials']) for cell in cells]
    assert kinds == [('changes_way', rule, 1) for rule in ('none', 'foc')]
    for cell in cells:
        assert cell['completion_s_interval'][0] <= cell['completion_s'] <= cell['completion_s_interval'][1]
    assert (cells[0]['effort_difference'], cells[0]['wrong_way_s']) == (0.0, None)
    page = (tmp_path / 'simulation.html').read_text('utf-8')
    assert page.count('<figure>') == 4 and 'foc' in page


def test_recorded_paths_are_intended_paths_and_one_that_comes_back_arrives_at_its_end(tmp_path, capsys):
    """The second one among no obstacles, which have no clearance."""
    past = write_tables(tmp_path / 'past', {'a': reach(0.05, (0.3, 0.0))}, [(0.3, 0.0), (0.3, 0.2)], [(0.15, 0.0, 0.02)])
    options = ['--operators', 'human_paths', '--assistance', 'none', '--trials', '1', '--workers', '1']
    (cell,) = run(tmp_path, capsys, *options, '--recordings', str(past))
    assert cell['collision_rate'] == 0.0
    assert cell['min_clearance_m'] == pytest.approx(0.03, abs=0.01)
    t, there = reach(0.05, (0.3, 0.0))
    back = np.concatenate([t, t + t[-1] + t[1]]), np.concatenate([there, there[::-1]])
    write_tables(tmp_path, {'a': back}, [(0.3, 0.0), (0.0, 0.0)])
    options = ['--operators', 'human_paths', '--trials', '1', '--workers', '1', '--recordings', str(tmp_path)]
    main(['simulate', *options, '--params', str(tmp_path / 'parameters.yaml'), '--json'])
    captured = capsys.readouterr()
    for cell in json.loads(captured.out)['cells']:
        assert cell['completion_s'] > 2.0 and cell['path_m'] > 0.6
        assert cell['min_clearance_m'] is None
    assert 'invalid value' not in captured.err


STUDY = Path(__file__).parents[1] / 'benchmarks' / 'assistance.py'


def test_the_study_of_rival_rules_prints_the_cells_of_simulate():
    options = ['--operators', 'noisy', '--assistance', 'blend,potential_field', '--trials', '1', '--workers', '1', '--json']
    done = subprocess.run([sys.executable, STUDY, *options], capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    cells = json.loads(done.stdout)['cells']
    kinds = [(cell['operator'], cell['assistance']) for cell in cells]
    assert kinds == [('noisy', rule) for rule in ('none', 'blend', 'potential_field')]
    assert all(low <= cell['effort'] <= high for cell in cells for low, high in [cell['effort_interval']])
