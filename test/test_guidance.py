"""Guidance: every part against a case with a known answer, and the public class."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from guidance_samples import PERIOD
from hypothesis import given, strategies
from prediction_samples import outcome, prediction

import foc_ros
from foc_ros.core.config import Config, GuidanceConfig
from foc_ros.core.guidance.guide import (
    SHARPNESS,
    GuidanceInput,
    GuidanceState,
    combine,
    guide,
    weigh_candidates,
    yield_to_hand,
)
from foc_ros.core.guidance.limits import (
    TOLERANCE,
    build_margins,
    find_largest_force,
    limit_by_energy,
    measure_opposing_distance,
    see_margins,
    step_force,
    turn_along,
    update_energy,
)
from foc_ros.core.guidance.paths import (
    POSITION_STDDEV,
    WINDOW_M,
    advance_progress,
    build_paths,
    compute_stiffness,
    find_crossing,
    find_deflection,
    find_need,
    keep_clear,
    project_out,
    saturate,
    transfer_progress,
)
from foc_ros.core.types import Array, Prediction, make_obstacles

ROUND = make_obstacles([(0.1, 0.0)], [0.03])
SETTINGS = GuidanceConfig(k_max=100.0, clearance=0.0)


def straight(label: str = 'goal0:', likelihood: float = 1.0, start: Array = (0.0, 0.0), end: Array = (0.3, 0.0), **rest: object):
    """Return a candidate along a straight line."""
    base = outcome(label, likelihood)
    mean = base.mean.copy()
    mean[:, :2] = np.linspace(start, end, len(mean))
    return replace(base, solution=replace(base.solution, mean=mean, covariance=np.zeros((len(mean), 6, 6)), **rest))


def guide_hand(config: Config, newest: Prediction, position: Array, velocity: Array, seconds: float = 0.15):
    """Return the output after a time in which the hand does not move, whatever velocity it reports."""
    state = GuidanceState()
    for tick in range(round(seconds / PERIOD)):
        given_now = GuidanceInput(tick * PERIOD, np.array(position), np.array(velocity), newest)
        output, state = guide(config, state, given_now)
    return output


@pytest.mark.parametrize(('stddev', 'share'), [(1.0, 0.0), (0.1, 0.0), (0.02, 1.0), (0.001, 1.0), (1300**-0.5, 0.5)])
def test_the_stiffness_is_linear_in_the_precision_between_its_bounds(stddev: float, share: float) -> None:
    variance = max(stddev**2 - POSITION_STDDEV**2, 0.0)
    stiffness = compute_stiffness(np.array([variance * np.eye(2)]), SETTINGS)
    assert stiffness[0] == pytest.approx(share * 100.0 * np.eye(2), abs=1e-3)


def test_the_stiffness_turns_with_the_covariance() -> None:
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    stiffness = compute_stiffness(np.array([turn @ np.diag([1e-6, 1.0]) @ turn.T]), SETTINGS)
    assert stiffness[0] == pytest.approx(turn @ np.diag([100.0, 0.0]) @ turn.T, abs=1e-6)


def test_no_stiffness_is_left_along_the_path() -> None:
    tangent = np.array([[0.6, 0.8]])
    projected = project_out(np.array([[[50.0, 10.0], [10.0, 80.0]]]), tangent)
    assert projected[0] @ tangent[0] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.linalg.eigvalsh(projected[0]).min() >= -1e-12


def test_a_deflection_gives_its_force_where_there_is_stiffness() -> None:
    stiffness = 50.0 * np.outer([0.6, 0.8], [0.6, 0.8])
    deflection = find_deflection(stiffness, np.array([1.2, 1.6]))
    assert deflection == pytest.approx([0.024, 0.032])
    assert find_deflection(np.zeros((2, 2)), np.ones(2)).tolist() == [0.0, 0.0]


def test_forces_that_agree_add_up_and_those_that_cancel_vanish() -> None:
    none = np.zeros(2, dtype=bool)
    force, agreement = combine(np.array([0.7, 0.3]), np.array([[1.0, 0.0], [2.0, 0.0]]), none)
    assert (force[0], agreement) == (pytest.approx(1.3), 1.0)
    force, agreement = combine(np.array([0.5, 0.5]), np.array([[0.0, 1.0], [0.0, -1.0]]), none)
    assert (force.tolist(), agreement) == ([0.0, 0.0], 0.0)
    force, agreement = combine(np.array([0.75, 0.25]), np.array([[0.0, 1.0], [0.0, -1.0]]), none)
    assert (force[1], agreement) == (pytest.approx(0.25), pytest.approx(0.5))
    force, agreement = combine(np.array([0.75, 0.25]), np.array([[0.0, 1.0], [0.0, -1.0]]), np.array([False, True]))
    assert (force[1], agreement) == (pytest.approx(0.75 * 0.75), pytest.approx(0.75))


@pytest.mark.parametrize(('across', 'share'), [(0.0, 1.0), (0.5, 1.0), (-0.2, 0.6), (-0.5, 0.0), (-3.0, 0.0)])
def test_a_force_yields_to_a_hand_that_accelerates_against_it(across: float, share: float) -> None:
    force = yield_to_hand(np.array([0.0, 2.0]), np.array([5.0, across]), 0.5)
    assert force == pytest.approx([0.0, 2.0 * share])
    assert yield_to_hand(np.array([0.0, 2.0]), np.array([0.0, across]), 0.0).tolist() == [0.0, 2.0]


def test_what_is_unknown_takes_part_without_a_force() -> None:
    assert weigh_candidates(np.array([0.5, 0.5]), 0.0) == pytest.approx([0.5, 0.5])
    assert weigh_candidates(np.array([0.3]), 0.7) == pytest.approx([0.3**SHARPNESS / (0.3**SHARPNESS + 0.7**SHARPNESS)])
    assert weigh_candidates(np.zeros(2), 0.0).tolist() == [0.0, 0.0]


def test_the_progress_follows_the_hand_and_does_not_jump_to_a_distant_part() -> None:
    base = straight()
    mean = np.zeros((9, 6))
    mean[:, :2] = [(0, 0), (0.1, 0), (0.2, 0), (0.3, 0), (0.3, 0.01), (0.3, 0.02), (0.2, 0.02), (0.1, 0.02), (0.0, 0.02)]
    hairpin = replace(base, solution=replace(base.solution, mean=mean, covariance=np.zeros((9, 6, 6))))
    paths, progress = build_paths(prediction(hairpin)), np.array([0.1])
    for tick in range(100):  # nearer to the way back than to the way out
        position = np.array([0.1 + 0.001 * tick, 0.015])
        before, progress = progress, advance_progress(paths, progress, position, np.array([0.2, 0.0]), PERIOD)
        assert abs(progress[0] - before[0]) <= 0.2 * PERIOD + WINDOW_M
    assert progress[0] == pytest.approx(0.2, abs=0.01)


def test_a_new_prediction_takes_over_the_point_of_the_old_one() -> None:
    paths = build_paths(prediction(straight(), straight('goal1:', 0.5, (0.0, 0.0), (0.0, 0.3))))
    known = {'goal0:': np.array([0.015, 0.05])}
    progress = transfer_progress(paths, known, np.array([0.0, 0.012]), 0.01)
    assert progress == pytest.approx([0.015, 0.012])
    assert transfer_progress(paths, {'goal0:': np.array([0.2, 0.0])}, np.zeros(2), 0.01)[0] == pytest.approx(0.01 + WINDOW_M)


def test_the_tank_pays_for_work_and_takes_up_damping() -> None:
    assert update_energy(0.5, np.array([2.0, 0.0]), np.array([0.1, 1.0]), 0.5) == pytest.approx(0.3)
    assert update_energy(0.3, np.array([2.0, 0.0]), np.array([-0.05, 0.0]), 0.5) == pytest.approx(0.4)
    assert update_energy(0.3, np.array([2.0, 0.0]), np.array([-1.0, 0.0]), 0.5) == 0.5


@given(energy=strategies.floats(0, 10), slew=strategies.floats(1, 1e3), speed=strategies.floats(0.1, 10))
def test_a_force_within_the_tank_can_be_slewed_to_zero(energy: float, slew: float, speed: float) -> None:
    period = 0.01
    force = limit_by_energy(energy, slew, speed, period)
    assert speed * (force * period + force**2 / (2.0 * slew)) == pytest.approx(energy, rel=1e-6, abs=1e-9)


def test_the_force_steps_towards_its_target_within_its_bound() -> None:
    forward = step_force(np.zeros(2), np.array([3.0, 4.0]), 1.0, lambda _: 10.0)
    assert forward == pytest.approx([0.6, 0.8])
    assert step_force(forward, np.array([0.6, 0.9]), 1.0, lambda _: 10.0) == pytest.approx([0.6, 0.9])
    assert np.hypot(*step_force(forward, np.array([3.0, 4.0]), 5.0, lambda _: 2.0)) == pytest.approx(2.0)
    shrunk = step_force(np.array([2.0, 0.0]), np.array([2.0, 0.0]), 0.1, lambda _: 0.0)
    assert shrunk == pytest.approx([1.9, 0.0])  # as near to its bound as the slew limit allows


def test_the_largest_force_can_be_released_within_the_ramp() -> None:
    assert find_largest_force(GuidanceConfig(f_max=3.0, slew=100.0, ramp_s=0.1)) == 3.0
    assert find_largest_force(GuidanceConfig(f_max=3.0, slew=10.0, ramp_s=0.1)) == 1.0


def test_a_force_is_turned_along_a_margin_that_its_line_crosses() -> None:
    seen = see_margins(build_margins(ROUND, 0.002), np.zeros(2))
    turned = turn_along(seen, np.array([0.2, 0.0]), np.array([1.0, 0.5]))
    assert turned == pytest.approx([0.0, 0.5], abs=0.1)
    assert abs(turned[0]) <= TOLERANCE * np.hypot(*turned)
    beside = turn_along(seen, np.array([0.2, 0.2]), np.array([1.0, 1.0]))
    assert beside.tolist() == [1.0, 1.0]
    short = turn_along(seen, np.array([0.05, 0.0]), np.array([1.0, 0.0]))
    assert short.tolist() == [1.0, 0.0]


def test_the_distance_of_a_margin_counts_in_front_of_the_force_only() -> None:
    margins = build_margins(ROUND, 0.0)
    outside, inside = see_margins(margins, np.zeros(2)), see_margins(margins, np.array([0.08, 0.0]))
    assert measure_opposing_distance(outside, np.array([1.0, 0.0])) == pytest.approx(0.07, abs=5e-4)
    assert measure_opposing_distance(outside, np.array([-1.0, 0.0])) == pytest.approx(np.hypot(0.1, 0.03), abs=5e-3)
    assert measure_opposing_distance(inside, np.array([1.0, 0.0])) == 0.0
    assert measure_opposing_distance(inside, np.array([-1.0, 0.0])) > 0.03


def test_a_hand_beside_its_only_path_is_drawn_to_it() -> None:
    output = guide_hand(Config(guidance=SETTINGS), prediction(straight(), stamp_ns=0), (0.1, 0.01), (0.0, 0.0))
    assert output.force == pytest.approx([0.0, -1.0], abs=1e-6)
    assert output.reference == pytest.approx([0.1, 0.0], abs=1e-6)
    assert output.agreement == 1.0


def test_the_mode_trajectory_keeps_the_force_along_the_path() -> None:
    newest = prediction(straight(), stamp_ns=0)
    config = {mode: Config(guidance=replace(SETTINGS, mode=mode, lookahead_s=0.1)) for mode in ('path', 'trajectory')}
    forces = {mode: guide_hand(each, newest, (-0.01, 0.01), (0.001, 0.0)).force for mode, each in config.items()}
    assert forces['path'] == pytest.approx([0.0, -1.0], abs=1e-6)
    assert forces['trajectory'][0] > 0.9


def test_in_mode_path_the_force_neither_drives_nor_brakes_a_moving_hand() -> None:
    velocity = np.array([0.3, 0.2])
    output = guide_hand(Config(guidance=SETTINGS), prediction(straight(), stamp_ns=0), (0.1, 0.01), velocity)
    assert np.hypot(*output.force) > 1.0
    assert abs(output.force @ velocity) < 0.05 * np.hypot(*output.force) * np.hypot(*velocity)


def bent(label: str, likelihood: float, aside: float):
    """Return a candidate that begins along the first axis and bends aside."""
    base = straight(label, likelihood)
    mean = base.mean.copy()
    mean[:, 1] = aside * np.array([0.0, 0.0, 0.3, 0.6, 1.0])
    return replace(base, solution=replace(base.solution, mean=mean))


def test_a_hand_at_a_fork_is_left_alone() -> None:
    fork = prediction(bent('goal0:+1', 0.5, 0.1), bent('goal0:-1', 0.5, -0.1), stamp_ns=0)
    output = guide_hand(Config(guidance=SETTINGS), fork, (0.0, 0.0), (0.6, 0.0))
    assert output.force == pytest.approx([0.0, 0.0], abs=1e-6)
    assert output.agreement == pytest.approx(0.0, abs=1e-6)
    decided = prediction(bent('goal0:+1', 0.9, 0.1), bent('goal0:-1', 0.1, -0.1), stamp_ns=0)
    assert guide_hand(Config(guidance=SETTINGS), decided, (0.0, 0.0), (0.6, 0.0)).force[1] > 0.5


def test_the_look_ahead_damps_movement_across_the_path() -> None:
    newest, velocity = prediction(straight(), stamp_ns=0), (0.0, 0.05)
    settings = replace(SETTINGS, mode='trajectory', lookahead_s=0.1)
    output = guide_hand(Config(guidance=settings), newest, (0.0, 0.0), velocity)
    assert output.force[1] == pytest.approx(-0.1 * 100.0 * 0.05, abs=1e-6)
    none = guide_hand(Config(guidance=replace(settings, lookahead_s=0.0)), newest, (0.0, 0.0), velocity)
    assert none.force == pytest.approx([0.0, 0.0], abs=1e-6)


def test_help_is_needed_where_the_hand_would_come_too_near_to_an_obstacle() -> None:
    settings = GuidanceConfig(clearance=0.02, lookahead_s=0.2)
    velocity = np.array([0.4, 0.0])
    assert find_need(settings, ROUND, np.zeros(2), velocity)[:2] == (0.2, 1.0)  # 80 mm ahead lies inside
    assert find_need(settings, ROUND, np.array([0.0, 0.051]), velocity).share == 0.0
    need = find_need(settings, ROUND, np.array([0.06, 0.045]), velocity)
    assert (need.time_s, need.share) == (pytest.approx(0.1), pytest.approx(0.25))
    assert need.normal == pytest.approx([0.0, 1.0])
    assert find_need(settings, make_obstacles(), np.zeros(2), velocity)[:2] == (0.0, 0.0)
    assert find_need(replace(settings, clearance=0.0), ROUND, np.zeros(2), velocity)[:2] == (0.2, 1.0)


def test_no_force_leads_across_an_obstacle_to_the_other_side() -> None:
    need = find_need(GuidanceConfig(clearance=0.02, lookahead_s=0.2), ROUND, np.array([0.06, 0.045]), np.array([0.4, 0.0]))
    assert find_crossing(need, np.array([[0.0, 0.01], [0.0, -0.01], [0.01, 0.0]])).tolist() == [False, True, False]
    settings = replace(SETTINGS, clearance=0.02)
    position, velocity = (0.01, 0.01), (0.5, 0.0)
    same = prediction(bent('goal0:+0', 1.0, 0.2), stamp_ns=0, obstacles=ROUND)
    other = prediction(bent('goal0:-0', 1.0, -0.2), stamp_ns=0, obstacles=ROUND)
    assert guide_hand(Config(guidance=settings), same, position, velocity).force[1] > 0.5
    assert guide_hand(Config(guidance=settings), other, position, velocity).force.tolist() == [0.0, 0.0]


def test_references_are_moved_out_to_the_clearance() -> None:
    settings = GuidanceConfig(clearance=0.02)
    moved = keep_clear(settings, ROUND, np.array([[0.1, 0.035], [0.1, -0.06]]))
    assert moved == pytest.approx(np.array([[0.1, 0.05], [0.1, -0.06]]))
    gap = make_obstacles([(0.1, 0.04), (0.1, -0.04)], [0.03, 0.03])
    assert keep_clear(settings, gap, np.array([[0.1, 0.005]]))[0, 1] < 0.0 + 1e-12


def test_an_error_is_not_longer_than_what_the_hand_lacks_of_the_clearance() -> None:
    errors = saturate(GuidanceConfig(clearance=0.02), np.array([[0.0, 0.01], [0.0, -0.08]]), 0.75)
    assert errors.tolist() == [[0.0, 0.01], [0.0, pytest.approx(-0.015)]]
    assert saturate(GuidanceConfig(clearance=0.02), errors, 0.0).tolist() == [[0.0, 0.0], [0.0, 0.0]]


def test_a_hand_far_from_obstacles_is_left_alone_and_one_that_comes_too_near_is_turned_away() -> None:
    newest = prediction(bent('goal0:+0', 1.0, 0.2), stamp_ns=0, obstacles=ROUND)
    settings = replace(SETTINGS, clearance=0.02)
    far = guide_hand(Config(guidance=settings), newest, (0.0, 0.06), (0.3, 0.0))
    near = guide_hand(Config(guidance=settings), newest, (0.01, 0.03), (0.5, 0.0))
    assert far.force.tolist() == [0.0, 0.0]
    assert near.force[1] > 0.5


def test_a_blended_command_is_never_faster_and_equals_the_command_without_authority() -> None:
    output = guide_hand(Config(), prediction(straight(), stamp_ns=0), (0.0, 0.0), (0.0, 0.0))
    command = np.array([0.0, 0.1])
    blended = output.blend_command(command)
    assert output.authority == pytest.approx(0.5)
    assert blended == pytest.approx([0.05, 0.05], abs=1e-9)
    assert np.hypot(*blended) <= 0.1
    assert replace(output, authority=0.0).blend_command(command).tolist() == command.tolist()
    assert output.blend_command(np.zeros(2)).tolist() == [0.0, 0.0]


def test_mirrored_input_gives_mirrored_guidance() -> None:
    mirror = np.array([1.0, -1.0])
    forces = []
    for sign in (1.0, -1.0):
        end = np.array([0.3, sign * 0.1])
        newest = prediction(
            straight('goal0:', 0.8, (0.0, 0.0), end),
            straight('goal1:', 0.2, (0.0, 0.0), (0.3, 0.0)),
            stamp_ns=0,
            obstacles=make_obstacles([(0.05, -sign * 0.03)], [0.02]),
        )
        forces.append(guide_hand(Config(), newest, (0.02, -sign * 0.005), (0.2, -sign * 0.05)).force)
    assert forces[0] == pytest.approx(forces[1] * mirror, abs=1e-9)
    assert np.hypot(*forces[0]) > 0.01


def test_the_public_class_checks_its_input_and_keeps_its_state() -> None:
    config = foc_ros.Config(guidance=SETTINGS)
    guidance, newest = foc_ros.Guidance(config), prediction(straight(), stamp_ns=0)
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


def test_equal_input_gives_equal_guidance() -> None:
    runs = [guide_hand(Config(), prediction(straight(), stamp_ns=0), (0.1, 0.01), (0.1, 0.0)) for _ in range(2)]
    assert all(np.array_equal(getattr(runs[0], name), getattr(runs[1], name)) for name in vars(runs[0]))
