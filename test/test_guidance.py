# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Guidance: every part against a case with a known answer, and the public class."""

from dataclasses import replace

import numpy as np
import prediction_samples
import pytest
from prediction_samples import outcome

import foc_ros
from foc_ros.core.config import Config, GuidanceConfig
from foc_ros.core.guidance.guide import DOUBT, GuidanceInput, GuidanceState, combine, guide, weigh_candidates
from foc_ros.core.guidance.limits import build_margins
from foc_ros.core.guidance.paths import POSITION_STDDEV, compute_stiffness, find_crossing, find_need
from foc_ros.core.obstacle_table import make_obstacles

ROUND = make_obstacles([(0.1, 0.0)], [0.03])
ZONES = build_margins(ROUND, 0.02)
SETTINGS = GuidanceConfig(k_max=100.0, clearance=0.0)
SURE = (1.0 - DOUBT) / (1.0 + DOUBT)
"""Share of the force of a certain candidate at rest."""


def prediction(*outcomes, **changes):
    """Return a prediction of these outcomes, without obstacles if none are given."""
    return prediction_samples.prediction(*outcomes, **({'obstacles': make_obstacles(), 'stamp_ns': 0} | changes))


def straight(label='goal0:', likelihood=1.0, end=(0.3, 0.0), aside=0.0):
    """Return a candidate along a straight line from the origin, or one that bends aside from it."""
    base = outcome(label, likelihood)
    mean = base.mean.copy()
    mean[:, :2] = np.linspace((0.0, 0.0), end, len(mean))
    mean[:, 1] += aside * np.array([0.0, 0.0, 0.3, 0.6, 1.0])
    return replace(base, solution=replace(base.solution, mean=mean, covariance=np.zeros((len(mean), 6, 6))))


def guide_hand(newest, position, velocity, settings=SETTINGS):
    """Return the output after 0.15 s in which the hand does not move, whatever velocity it reports."""
    config, state = Config(guidance=settings), GuidanceState()
    for tick in range(30):
        given_now = GuidanceInput(0.005 * tick, np.array(position), np.array(velocity), newest)
        output, state = guide(config, state, given_now)
    return output


@pytest.mark.parametrize(('stddev', 'share'), [(1.0, 0.0), (0.1, 0.0), (0.02, 1.0), (0.001, 1.0), (1300**-0.5, 0.5)])
def test_the_stiffness_is_linear_in_the_precision_between_its_bounds(stddev, share):
    variance = max(stddev**2 - POSITION_STDDEV**2, 0.0)
    stiffness = compute_stiffness(np.array([variance * np.eye(2)]), SETTINGS)
    assert stiffness[0] == pytest.approx(share * 100.0 * np.eye(2), abs=1e-3)


def test_a_force_yields_to_a_hand_that_accelerates_against_it():
    pull, certain = np.array([[0.0, 2.0]]), np.array([1.0])
    sizes = [
        combine(weigh_candidates(certain, pull, np.array([0.0, across])), pull, np.zeros(1, dtype=bool))[0][1]
        for across in (1e6, 1.0, 0.0, -1.0, -2.5, -1e6)
    ]
    assert sizes[0] == pytest.approx(2.0) and (np.diff(sizes) < 0.0).tolist() == [True, True, True, True, False]
    assert sizes[2] == pytest.approx(2.0 * SURE) and sizes[4:] == [0.0, 0.0]


def test_a_hand_beside_its_only_path_is_drawn_to_it():
    output = guide_hand(prediction(straight()), (0.1, 0.01), (0.0, 0.0))
    assert output.force == pytest.approx([0.0, -SURE], abs=1e-6)
    assert output.reference == pytest.approx([0.1, 0.0], abs=1e-6)
    assert output.agreement == pytest.approx(SURE)


@pytest.mark.parametrize('share', ['unknown', 'other'])
def test_a_force_yields_to_classes_and_goals_that_are_not_followed(share):
    output = guide_hand(prediction(straight(likelihood=0.8), **{share: 0.2}), (0.1, 0.01), (0.0, 0.0))
    assert output.force == pytest.approx([0.0, 1.0 - 2.0 * 0.8 / (1.0 + DOUBT)], abs=1e-6)


def test_in_mode_path_the_force_neither_drives_nor_brakes_a_moving_hand_and_in_mode_trajectory_it_does():
    newest, velocity = prediction(straight()), np.array([0.3, 0.2])
    force = guide_hand(newest, (0.1, 0.01), velocity).force
    assert np.hypot(*force) > 1.0
    assert abs(force @ velocity) < 0.05 * np.hypot(*force) * np.hypot(*velocity)
    path, trajectory = (
        guide_hand(newest, (-0.01, 0.01), (0.001, 0.0), replace(SETTINGS, mode=mode, lookahead_s=0.1)).force
        for mode in ('path', 'trajectory')
    )
    assert path == pytest.approx([0.0, -SURE], abs=1e-6)
    assert trajectory[0] > 0.9 * SURE


def test_a_hand_at_a_fork_is_left_alone():
    fork = prediction(straight('goal0:+1', 0.5, aside=0.1), straight('goal0:-1', 0.5, aside=-0.1))
    output = guide_hand(fork, (0.0, 0.0), (0.6, 0.0))
    assert output.force == pytest.approx([0.0, 0.0], abs=1e-6)
    assert output.agreement == pytest.approx(0.0, abs=1e-6)
    decided = prediction(straight('goal0:+1', 0.9, aside=0.1), straight('goal0:-1', 0.1, aside=-0.1))
    assert guide_hand(decided, (0.0, 0.0), (0.6, 0.0)).force[1] > 0.5


def test_the_look_ahead_damps_movement_across_the_path():
    newest, velocity = prediction(straight()), (0.0, 0.05)
    settings = replace(SETTINGS, mode='trajectory', lookahead_s=0.1)
    output = guide_hand(newest, (0.0, 0.0), velocity, settings)
    assert output.force[1] == pytest.approx(-0.1 * SURE * 100.0 * 0.05, abs=1e-6)
    none = guide_hand(newest, (0.0, 0.0), velocity, replace(settings, lookahead_s=0.0))
    assert none.force == pytest.approx([0.0, 0.0], abs=1e-6)


def test_a_hand_near_an_obstacle_is_turned_away_from_it_and_no_force_leads_across_it_to_the_other_side():
    need = find_need(GuidanceConfig(clearance=0.02, lookahead_s=0.2), ZONES, np.array([0.06, 0.045]), np.array([0.4, 0.0]))
    assert find_crossing(need, np.array([[0.0, 0.01], [0.0, -0.01], [0.01, 0.0]])).tolist() == [False, True, False]
    settings = replace(SETTINGS, clearance=0.02)
    position, velocity = (0.01, 0.01), (0.5, 0.0)
    same = prediction(straight('goal0:+0', 1.0, aside=0.2), obstacles=ROUND)
    other = prediction(straight('goal0:-0', 1.0, aside=-0.2), obstacles=ROUND)
    assert guide_hand(same, position, velocity, settings).force[1] > 0.5
    assert guide_hand(other, position, velocity, settings).force.tolist() == [0.0, 0.0]
    assert guide_hand(same, (0.0, 0.06), velocity, settings).force.tolist() == [0.0, 0.0], 'it is far away'


def test_a_blended_command_is_never_faster_and_equals_the_command_without_authority():
    output = guide_hand(prediction(straight()), (0.0, 0.0), (0.0, 0.0), GuidanceConfig())
    command = np.array([0.0, 0.1])
    blended = output.blend_command(command)
    assert output.authority == pytest.approx(0.5)
    assert blended == pytest.approx([0.05, 0.05], abs=1e-9)
    assert np.hypot(*blended) <= 0.1
    assert replace(output, authority=0.0).blend_command(command).tolist() == command.tolist()
    assert output.blend_command(np.zeros(2)).tolist() == [0.0, 0.0]
    assert output.blend_command((0, 0.1)).tolist() == blended.tolist(), 'any sequence will do'
    with pytest.raises(foc_ros.InputError, match=r'^command: expected finite numbers of shape \(2,\), got \(0, 0\.1, 0\)'):
        output.blend_command((0, 0.1, 0))
    with pytest.raises(foc_ros.InputError, match=r'^command: expected numbers in .*, got .*nan'):
        output.blend_command((np.nan, 0.1))


def test_mirrored_input_gives_mirrored_guidance():
    mirror = np.array([1.0, -1.0])
    forces = []
    for sign in (1.0, -1.0):
        end = np.array([0.3, sign * 0.1])
        newest = prediction(
            straight('goal0:', 0.8, end),
            straight('goal1:', 0.2),
            obstacles=make_obstacles([(0.05, -sign * 0.03)], [0.02]),
        )
        forces.append(guide_hand(newest, (0.02, -sign * 0.005), (0.2, -sign * 0.05), GuidanceConfig()).force)
    assert forces[0] == pytest.approx(forces[1] * mirror, abs=1e-9)
    assert np.hypot(*forces[0]) > 0.01


def test_the_public_class_checks_its_input_and_keeps_its_state():
    config = foc_ros.Config(guidance=SETTINGS)
    guidance, newest = foc_ros.Guidance(config), prediction(straight())
    guidance.update(0.0, (0.1, 0.03), (0.0, 0.0), newest)
    output = guidance.update(0.005, (0.1, 0.03), (0.0, 0.0), newest)
    assert output.status is foc_ros.GuidanceStatus.GUIDING and output.force[1] < 0.0
    for wrong, field in (
        ((0.005, (0.1, 0.01), (0.0, 0.0), newest), 't'),
        ((0.1, (np.nan, 0.01), (0.0, 0.0), newest), 'position'),
        ((0.1, (0.1, 0.01), (0.0, np.inf), newest), 'velocity'),
        ((0.1, (0.1, 0.01), (0.0, 0.0), 'newest'), 'prediction'),
    ):
        with pytest.raises(foc_ros.InputError, match=f'^{field}: expected'):
            guidance.update(*wrong)
    assert guidance.update(0.01, (0.1, 0.03), (0.0, 0.0), newest).force[1] < output.force[1]
    guidance.reset()
    assert guidance.update(0.0, (0.1, 0.01), (0.0, 0.0), newest).force.tolist() == [0.0, 0.0]
