# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Guidance is as continuous as the movement of the hand: no force that goes on and off, no command that jumps."""

from dataclasses import replace

import numpy as np
import pytest
from prediction_samples import outcome, prediction

from foc_ros.core.config import Config, GuidanceConfig, replace_values
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceState, guide
from foc_ros.core.guidance.limits import build_margins
from foc_ros.core.guidance.paths import find_need
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets

PERIOD = 0.005
SQUARE = np.array([[0.025, 0.025], [-0.025, 0.025], [-0.025, -0.025], [0.025, -0.025]])
TURN = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
SHAPES = {
    'circle': (np.zeros((1, 2)), 0.03),
    'capsule': (np.array([[0.0, -0.03], [0.0, 0.03]]), 0.01),
    'tilted capsule': (np.array([[-0.02, -0.03], [0.02, 0.03]]), 0.01),
    'box': (SQUARE, 0.0),
    'turned box': (SQUARE @ TURN.T, 0.0),
    'triangle': (np.array([[0.03, -0.03], [0.03, 0.04], [-0.03, 0.0]]), 0.0),
}


def place(shape, sign=1):
    """Return the obstacle of this name 0.2 m ahead; sign -1: its mirror image."""
    polygon, radius = SHAPES[shape]
    return make_obstacles([(0.2, 0.0)], [radius], polygons=[polygon[::sign] * (1, sign)])


def predict(position, obstacles, sign):
    """Return a prediction of two ways round an obstacle, the first of which is four times as likely."""
    base, ways = outcome(), []
    u = np.linspace(0.0, 1.0, len(base.mean))[:, None]
    for label, likelihood, side in (('goal0:+0', 0.8, sign), ('goal0:-0', 0.2, -sign)):
        mean = base.mean.copy()
        mean[:, :2] = position + u * ((0.35, 0.02 * sign) - position) + np.sin(np.pi * u) * (0.0, 0.05 * side)
        way = outcome(label, likelihood)
        ways.append(replace(way, solution=replace(way.solution, mean=mean)))
    return prediction(*ways, stamp_ns=0, obstacles=obstacles)


SPEED = 0.35


def go_straight(shape, aside, sign=1, to=0.25):
    """Return the outputs for a hand that goes straight ahead to a place [m], past an obstacle or through it."""
    state, outputs, obstacles = GuidanceState(), [], place(shape, sign)
    for tick in range(round(to / SPEED / PERIOD)):
        position = np.array([SPEED * PERIOD * tick, sign * aside])
        if tick % 4 == 0:
            newest = predict(position, obstacles, sign)
        given = GuidanceInput(PERIOD * tick, position, np.array([SPEED, 0.0]), newest)
        output, state = guide(Config(), state, given)
        outputs.append(output)
    return outputs


@pytest.mark.parametrize('shape', SHAPES)
def test_the_force_on_a_hand_at_constant_velocity_goes_on_and_off_once(shape):
    """Until the hand is at the obstacle: no force can help a hand that has pierced it."""
    for aside in (-0.012, 0.003, 0.012, 0.034):
        forces = np.array([each.force for each in go_straight(shape, aside, to=0.161)])
        is_on = np.hypot(*forces.T) > 0.05
        assert (is_on[1:] != is_on[:-1]).sum() <= 3, f'{1e3 * aside:g} mm aside'
        assert is_on.any() or aside < 0.0, f'{1e3 * aside:g} mm aside: there is no force'
    mirrored = np.array([each.force for each in go_straight(shape, aside, -1, to=0.161)])
    assert mirrored == pytest.approx(forces * (1, -1), abs=1e-6)


@pytest.mark.parametrize('gap_s', [0.02, 0.2])
def test_after_a_gap_of_updates_neither_force_nor_share_is_sudden(gap_s):
    config, velocity, late = Config().with_values({'guidance.slew': 20.0}), np.array([0.35, 0.0]), []
    for ahead_m in (0.05, 0.1, 0.13, 0.15):
        position = np.array([ahead_m, 0.006])
        newest = predict(position, place('circle'), 1)
        _, state = guide(config, GuidanceState(), GuidanceInput(0.0, position - gap_s * velocity, velocity, newest))
        late.append(guide(config, state, GuidanceInput(gap_s, position, velocity, newest))[0])
    assert 0.1 < max(np.hypot(*each.force) for each in late) <= 2.0 * PERIOD * 20.0 + 1e-9
    assert 0.01 < max(each.authority for each in late) <= 2.0 * PERIOD * 0.5 / GuidanceConfig().ramp_s + 1e-9


@pytest.mark.parametrize('shape', SHAPES)
def test_the_share_of_guidance_does_not_lead_into_an_obstacle_nearby(shape):
    for aside in (-0.012, 0.003, 0.034):
        outputs, obstacles = go_straight(shape, aside), place(shape)
        offsets, distances = measure_offsets(np.array([each.position for each in outputs]), obstacles)
        shares = np.array([each.authority * each.heading for each in outputs])
        into = -(shares * offsets[:, 0]).sum(axis=1) / distances[:, 0]
        height = distances[:, 0] - obstacles.radius[0] - GuidanceConfig().margin
        assert into[(height > 0.0) & (height < 0.005)].max(initial=0.0) < 0.1
        assert into[height > 0.1].max() > 0.35, 'far away, guidance has its share'


@pytest.mark.parametrize('shape', SHAPES)
def test_the_need_is_that_of_the_nearest_point_and_the_shortest_shift(shape):
    settings, rng, obstacles = GuidanceConfig(), np.random.default_rng(1), place(shape)
    zones, clearance, lookahead = build_margins(obstacles, settings.clearance), settings.clearance, settings.lookahead_s
    outside = 0
    for _ in range(300):
        position, velocity = rng.uniform((0.1, -0.1), (0.3, 0.1)), rng.normal(0.0, 0.2, 2)
        need = find_need(settings, zones, position, velocity)
        points = position + np.linspace(0.0, lookahead, 400)[:, None] * velocity
        offsets, distances = measure_offsets(points, obstacles)
        nearest, gap = distances[:, 0].argmin(), distances.min() - obstacles.radius[0]
        assert need.share == pytest.approx(min(max(1.0 - gap / clearance, 0.0), 1.0), abs=0.03)
        if 0.0 < gap < clearance:
            outside += 1
            assert need.normal @ offsets[nearest, 0] / distances[nearest, 0] > 0.95
        moved, turned = rng.normal(0.0, 1e-4, (2, 2))
        change = (np.hypot(*moved) + lookahead * np.hypot(*turned)) / clearance
        assert abs(find_need(settings, zones, position + moved, velocity + turned).share - need.share) <= change
    assert outside > 10


def test_another_clearance_counts_from_the_next_prediction_on_among_the_same_obstacles():
    position, obstacles = np.array([0.1, 0.035]), place('circle')
    wide, narrow = (replace_values(Config(), {'guidance.clearance': each}) for each in (0.05, 0.001))
    first, later = (GuidanceInput(0.0, position, np.array([0.3, 0.0]), predict(position, obstacles, 1)) for _ in range(2))
    before, state = guide(wide, GuidanceState(), first)
    fresh, _ = guide(narrow, GuidanceState(), first)
    after, _ = guide(narrow, state, later)
    assert not np.allclose(before.stiffness, fresh.stiffness), 'the clearance is no test'
    np.testing.assert_allclose(after.stiffness, fresh.stiffness, atol=1e-9)
