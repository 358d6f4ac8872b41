# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of the classes that are followed when obstacles move, are replaced, or get other names."""

import numpy as np
import pytest
from reach_helpers import make_predictor

import foc_ros
from foc_ros.core.config import Config
from foc_ros.core.obstacles.clearance import measure_clearance
from foc_ros.core.tracks import FULL_CHANGE_S

GOAL, TICK_S = (0.3, 0.0), 0.02


def make_gate(y, names=('a', 'b')):
    return [foc_ros.Circle((0.15, 0.055), 0.03, name=names[0]), foc_ros.Circle((0.15, y), 0.03, name=names[1])]


POST = foc_ros.Circle((0.17, 0.01), 0.03, name='5')
CUP, JAR = foc_ros.Circle((0.15, -0.01), 0.03, name='cup'), foc_ros.Circle((0.15, 0.02), 0.03, name='jar')
CHANGES = {
    'moves into the gap': (make_gate(-0.055), make_gate(-0.002)),
    'is replaced': ([CUP], [JAR]),
    'has another name': ([POST], [foc_ros.Circle((0.17, 0.01), 0.03, name='7')]),
    'is in another row': (make_gate(-0.055, ('', '')), make_gate(-0.055, ('', ''))[::-1]),
}


def follow(before, after, ticks=10):
    """Return the last prediction among obstacles, and those after they have changed, for a hand at rest."""
    predictor = make_predictor(Config(budget_s=0.0), GOAL, before)
    known = [predictor.update(TICK_S * tick, (0.0, 0.0)) for tick in range(ticks)][-1]
    predictor.set_obstacles(after)
    return known, [predictor.update(TICK_S * (ticks + tick), (0.0, 0.0)) for tick in range(ticks)]


@pytest.mark.parametrize('name', CHANGES)
def test_no_path_that_an_obstacle_blocks_or_whose_obstacles_are_gone_is_held(name):
    _, changed = follow(*CHANGES[name])
    fresh = make_predictor(Config(budget_s=0.0), GOAL, CHANGES[name][1]).update(0.0, (0.0, 0.0))
    for prediction in changed:
        assert {each.label for each in prediction} == {each.label for each in fresh}
        for each in prediction:
            assert measure_clearance(each.solution.path, prediction.obstacles, each.solution.dt) > 0.0
        shares = [each.likelihood for each in prediction] + [prediction.unknown, prediction.other]
        assert sum(shares) == pytest.approx(1.0)
    assert {each.label: each.likelihood for each in changed[-1]} == pytest.approx(
        {each.label: each.likelihood for each in fresh}, abs=0.01
    )


def test_what_a_blocked_class_had_is_unknown_until_the_others_have_won_it():
    known, changed = follow(*CHANGES['moves into the gap'])
    lost, most = known.candidates[0], TICK_S / FULL_CHANGE_S
    assert lost.label == 'goal0:-a+b' and lost.likelihood > 0.7
    assert changed[0].unknown >= lost.likelihood - most - 1e-9
    assert np.diff([each.unknown for each in changed]).max() <= 1e-9
    assert changed[-1].unknown < 0.01


def test_an_obstacle_that_has_a_new_name_in_each_message_is_one_obstacle():
    predictor = make_predictor(Config(budget_s=0.0), GOAL, POST)
    for tick in range(15):
        predictor.set_obstacles(foc_ros.Circle((0.17, 0.01), 0.03, name=f'{100 + tick}'))
        prediction = predictor.update(TICK_S * tick, (0.0, 0.0))
        assert {each.label for each in prediction} == {f'goal0:-{100 + tick}', f'goal0:+{100 + tick}'}


def test_a_class_that_is_no_candidate_any_more_gains_no_likelihood():
    """The hand turns away from a class that was never likely, while all other classes become dearer."""
    walls = [foc_ros.Circle((0.16, y), 0.022, radius_stddev=0.002) for y in (-0.1, -0.03, 0.04, 0.11)]
    predictor = make_predictor(Config(budget_s=0.0, homotopy={'max_detour': 1.15}), (0.32, 0.02), walls)
    before, held = {}, 0
    for tick in range(60):
        t = 0.01 * tick
        prediction = predictor.update(t, (0.25 * t, 0.45 * t**2))
        for each in prediction:
            if 'not followed' in each.solution.message:
                held += 1
                assert each.likelihood <= before[each.way] + 1e-9
        before = {each.way: each.likelihood for each in prediction}
    assert held, 'the hand is no test'
