# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`solve`: scenes from files, against the reference cases, closed forms and Monte Carlo."""

import json
import math
from typing import Any

import numpy as np
import pytest

import foc_ros
from foc_ros.cli.main import main
from foc_ros.core.solution import Status

SCENE: dict[str, Any] = {
    'start': [0.0, 0.0],
    'goal': [0.3, 0.0],
    'duration_s': 1.0,
    'steps': 50,
    'noise': [0.05, 0.05],
    'eta': 0.9,
    'strategy': 'optimal',
    'obstacles': [{'x': 0.15, 'y': 0.01, 'radius': 0.03, 'radius_stddev': 0.002}],
}


def solve(tmp_path, scene, *options):
    (tmp_path / 'scene.json').write_text(json.dumps(scene), 'utf-8')
    return main(['solve', str(tmp_path / 'scene.json'), *options])


def candidates(tmp_path, capsys, scene, *options, code=0):
    assert solve(tmp_path, scene, '--json', *options) == code
    captured = capsys.readouterr()
    assert code == 3 or captured.err == ''
    return json.loads(captured.out)['candidates']


def test_json_has_the_promised_names(tmp_path, capsys):
    found = candidates(tmp_path, capsys, SCENE, '--monte-carlo', '500')
    promised = 'label description goal sides status effort cost eta tau lambda likelihood qp_solves solve_ms'
    promised += ' mean velocity stddev mc_step mc_path'
    assert len(found) == 2
    for each in found:
        assert set(promised.split()) <= set(each)
        assert np.shape(each['mean']) == np.shape(each['velocity']) == np.shape(each['stddev']) == (51, 2)
        assert each['status'] == 'solved' and each['eta'] == pytest.approx(0.9, abs=1e-3)
        assert 0.9 - 0.05 < each['mc_path'] <= each['mc_step'] <= 1
    assert [each['sides'] for each in found] == [{'0': 'right'}, {'0': 'left'}]
    assert sum(each['likelihood'] for each in found) == pytest.approx(1) and found[0]['likelihood'] > found[1]['likelihood']
    kinds = [{'bound': bound, 'risk': risk} for bound, risk in (('gaussian', 'step'), ('cantelli', 'step'), ('gaussian', 'path'))]
    efforts = [candidates(tmp_path, capsys, {**SCENE, **each})[0]['effort'] for each in kinds]
    assert efforts[0] < efforts[1] and efforts[0] < efforts[2], 'bound and risk say what eta means'


@pytest.mark.parametrize(('duration_s', 'steps'), [(1.0, 30), (0.4, 50)])
def test_a_scene_without_noise_has_the_answer_of_the_python_interface(tmp_path, capsys, duration_s, steps):
    """The noise of the parameters is given for 0.02 s, and scaled to the step of the scene."""
    post = {'x': 0.15, 'y': 0.01, 'radius': 0.03}
    scene = {'start': [0, 0], 'goal': [0.3, 0], 'obstacles': [post], 'duration_s': duration_s, 'steps': steps}
    read = candidates(tmp_path, capsys, scene)
    config = foc_ros.Config().with_values({'foc.steps': steps})
    same = foc_ros.solve_classes((0, 0), (0.3, 0), foc_ros.Circle((0.15, 0.01), 0.03), duration_s=duration_s, config=config)
    assert [(each['label'], each['effort']) for each in read] == [(each.label, pytest.approx(each.effort)) for each in same]
    for one, other in zip(read, same, strict=True):
        np.testing.assert_allclose(one['mean'], other.mean[:, :2], atol=1e-9)


def test_only_the_class_of_a_guess_is_solved(tmp_path, capsys):
    for amplitude, side in ((0.05, 'left'), (-0.05, 'right')):
        (found,) = candidates(tmp_path, capsys, {**SCENE, 'guess': {'amplitude': amplitude}})
        assert found['sides'] == {'0': side}
        (via,) = candidates(tmp_path, capsys, {**SCENE, 'guess': [[0.15, amplitude]]})
        assert via['sides'] == {'0': side} and via['effort'] == pytest.approx(found['effort'], rel=1e-3)


def test_the_table_and_the_picture(tmp_path, capsys):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    assert solve(tmp_path, SCENE, '--plot', str(tmp_path / 'ways.png')) == 0
    assert (tmp_path / 'ways.png').read_bytes().startswith(b'\x89PNG')
    out = capsys.readouterr().out
    assert 'goal0: right of 0' in out and 'solved' in out and 'likelihood' in out


GOALS: dict[str, Any] = {
    'start': [0.0, 0.0],
    'goals': [{'position': [0.2, 0.0], 'name': 'tea'}, {'position': [0.45, 0.01], 'name': 'milk', 'object': 'back'}],
    'obstacles': [{'x': x, 'y': 0.0, 'radius': 0.03, 'id': name} for x, name in ((0.2, 'front'), (0.4, 'back'))],
}


def test_goals_have_names_and_the_object_of_a_goal_blocks_the_others_only(tmp_path, capsys):
    found = candidates(tmp_path, capsys, GOALS)
    assert {each['description'] for each in found} == {'tea: direct', 'milk: left of front', 'milk: right of front'}
    assert {each['status'] for each in found} == {'solved'}
    assert solve(tmp_path, GOALS, '--json') == 0
    goals = json.loads(capsys.readouterr().out)['goals']
    assert [(each['name'], each['position']) for each in goals] == [('tea', [0.2, 0.0]), ('milk', [0.45, 0.01])]
    shares = [sum(each['likelihood'] for each in found if each['goal'] == row) for row in (0, 1)]
    assert [each['likelihood'] for each in goals] == pytest.approx(shares)
    (guessed,) = candidates(tmp_path, capsys, {**GOALS, 'goals': GOALS['goals'][1:], 'guess': {'amplitude': 0.05}})
    assert guessed['description'] == 'milk: left of front' and guessed['status'] == 'solved'


def test_a_goal_without_a_path_is_named(tmp_path, capsys):
    ring = [{'x': 0.3 + 0.05 * math.cos(turn), 'y': 0.05 * math.sin(turn), 'radius': 0.03} for turn in range(7)]
    scene = {**SCENE, 'obstacles': ring, 'max_candidates': 4}
    del scene['goal']
    assert solve(tmp_path, {**scene, 'goals': [[0.1, 0.1], {'position': [0.3, 0.0], 'name': 'core'}]}) == 0
    out = capsys.readouterr().out
    assert 'core: no path to it was found' in out and ' solved in ' in out
    assert solve(tmp_path, {**scene, 'goal': [0.3, 0.0]}, '--plot', str(tmp_path / 'none.png')) == 3
    assert capsys.readouterr() == ('', 'foc_ros solve: no path was found between the start and any goal\n')
    assert (tmp_path / 'none.png').exists()


def test_the_terminal_gives_reason_and_remedy_of_what_is_not_solved(tmp_path, capsys):
    assert solve(tmp_path, {**SCENE, 'noise': [0.8, 0.8], 'eta': 0.99}) == 0
    shown = capsys.readouterr().out.replace('\n  ', ' ').splitlines()
    remedies = [line for line in shown if 'remedy' in line]
    assert remedies
    for line in remedies:
        assert line.startswith('goal0:') and any(line.endswith(f'remedy: {status.remedy}') for status in Status)


def test_json_describes_the_whole_solution(tmp_path, capsys):
    for each in candidates(tmp_path, capsys, {**SCENE, 'strategy': 'lv', 'start_stddev': 0.001}):
        assert each['costs']['effort'] == pytest.approx(each['effort']) and each['costs']['lambda_variance'] > 0
        covariance = np.array(each['covariance'])
        assert covariance.shape == (51, 6, 6)
        assert np.allclose(np.sqrt(covariance[:, [0, 1], [0, 1]]), each['stddev'])
        assert np.linalg.eigvalsh(covariance).min() > -1e-12
        assert np.shape(each['acceleration']) == (51, 2) and np.shape(each['control']) == (50, 2)
        assert np.sum(np.square(each['control'])) == pytest.approx(each['effort'])
        assert each['eta_at']['obstacle'] == '0' and 1 <= each['eta_at']['step'] <= 50
        assert each['eta_reachable'] is None and each['violation'] == 0 and each['violation_at'] is None
        assert each['rows'] and all(row['multiplier'] > 0 and row['tau'] == each['tau'] for row in each['rows'])
        assert min(abs(each['eta_at']['step'] - row['step']) for row in each['rows']) < 0.5


def test_json_of_an_unsolved_candidate_holds_what_was_reached(tmp_path, capsys):
    demanding = {**SCENE, 'eta': 0.999, 'noise': [0.6, 0.6]}
    soft = candidates(tmp_path, capsys, demanding)
    assert {each['status'] for each in soft} == {'compromised'}
    assert sum(each['likelihood'] for each in soft) == pytest.approx(1.0)
    assert all(0 < each['eta'] < 0.999 and each['eta_reachable'] is None for each in soft)
    far = candidates(tmp_path, capsys, {**demanding, 'shortfall': math.inf}, code=3)
    assert {each['status'] for each in far} == {'eta_unreachable'}
    assert all(0 < each['eta_reachable'] == each['eta'] < 0.999 and each['likelihood'] == 0 for each in far)
    walls = [{'x': 0.15, 'y': y, 'radius': 0.03} for y in (-0.02, 0.02)]
    (shut,) = candidates(tmp_path, capsys, {**SCENE, 'obstacles': walls, 'guess': {'amplitude': 0.0}}, code=3)
    assert shut['status'] == 'infeasible' and shut['violation'] > 0.005
    assert shut['violation_at']['obstacle'] in ('0', '1')
    assert solve(tmp_path, {**demanding, 'shortfall': math.inf}) == 3
    error = capsys.readouterr().err
    assert error.startswith('foc_ros solve: no candidate could be solved: goal0:') and error.count('\n') == 1


@pytest.mark.parametrize('shortfall', [6.0, math.inf])
@pytest.mark.parametrize('noise', [0.0, 1e-6, 1e-4])
@pytest.mark.parametrize('eta', [0.0, 0.9])
def test_a_hand_without_noise_passes_beside_an_obstacle_on_both_sides(eta, noise, shortfall):
    """The cost is that of the shortest paths, whatever eta is, and rounding does not decide whether eta is kept."""
    values = {'foc.eta': eta, 'foc.noise_x': noise, 'foc.noise_y': noise, 'likelihood.shortfall': shortfall}
    found = foc_ros.solve_classes(
        (0, 0), (0.3, 0), [foc_ros.Circle((0.15, 0.01), 0.03)], config=foc_ros.Config().with_values(values)
    )
    assert [(each.label, each.status.value) for each in found] == [('goal0:-0', 'solved'), ('goal0:+0', 'solved')]
    assert [each.solution.safety_shortfall for each in found] == [0.0, 0.0]
    assert min(each.solution.eta for each in found) >= eta
    assert [each.cost for each in found] == pytest.approx([73.4506, 98.3174], rel=3e-4)
    assert found[0].likelihood == pytest.approx(0.6298, abs=1e-3)
