# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Safety of guidance as properties: bounds, slew, release, passivity and margins, for hostile hands and predictions."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from prediction_samples import outcome, predict_aside, prediction

from foc_ros.core.config import Config, GuidanceConfig
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, GuidanceStatus, guide
from foc_ros.core.guidance.limits import find_largest_force
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.solution import Status
from foc_ros.core.types import Array

FEW, BATCH, BATCHES = range(100, 200), 1500, 2


def check_bounds(run):
    forces, settings, times = run.forces, run.config, np.array([each.t for each in run.outputs])
    assert np.isfinite(forces).all()
    assert np.hypot(*forces.T).max() <= settings.f_max * (1 + 1e-9)
    slews = np.hypot(*np.diff(forces, axis=0).T) / np.diff(times)
    assert slews.max() <= settings.slew * (1 + 1e-6)
    shares = np.array([each.authority * each.heading for each in run.outputs])
    rates = np.hypot(*np.diff(shares, axis=0).T) / np.diff(times)
    assert rates.max() <= settings.authority / settings.ramp_s * (1 + 1e-6)
    for output in run.outputs:
        values, asymmetry = np.linalg.eigvalsh(output.stiffness), output.stiffness - output.stiffness.T
        assert values.min() >= -1e-6 and values.max() <= settings.k_max * (1 + 1e-9) and np.abs(asymmetry).max() < 1e-6
        assert 0.0 <= output.agreement <= 1.0 and 0.0 <= output.authority <= settings.authority


def check_many(seeds):
    """Check hostile hands, half of which jump and so have no speed for which tank and margins are guaranteed."""
    extracted = near = 0
    for seed in seeds:
        has_jumps = seed % 2 == 1
        run = run_hostile(np.random.default_rng(seed), has_jumps=has_jumps)
        check_bounds(run)
        if not has_jumps:
            energy = run.measure_extracted_energy()
            assert energy <= run.config.tank + 1e-12
            assert run.measure_force_into_margins() <= 1e-9
            extracted += energy > 0.1 * run.config.tank
            near += bool(run.forces.any())
    assert extracted > len(seeds) / 100, 'hardly any hand extracts energy: the test is too kind'
    # an eighth of all; by chance, one batch has fewer than others
    assert near > len(seeds) / 10, 'hardly any hand feels a force: the test is too kind'


def test_hostile_hands():
    check_many(FEW)


@pytest.mark.parametrize('batch', range(BATCHES))
def test_thousands_of_hostile_hands(batch):
    check_many(range(BATCH * batch, BATCH * (batch + 1)))


def build_guiding_state(config):
    newest, state = predict_aside(stamp_ns=0), GuidanceState()
    for tick in range(60):
        given = GuidanceInput(PERIOD * tick, np.zeros(2), np.zeros(2), newest)
        output, state = guide(config, state, given)
    assert np.hypot(*output.force) > 0.9 * find_largest_force(config.guidance)
    return state, given


DEAD_MAN = {
    'clutch': ({'is_released': True}, GuidanceStatus.RELEASED),
    'no prediction': ({'prediction': None}, GuidanceStatus.NO_PREDICTION),
    'nothing solved': ({'prediction': prediction(stamp_ns=0)}, GuidanceStatus.NO_PREDICTION),
    'old prediction': ({'prediction_age_s': 0.3}, GuidanceStatus.STALE),
    'prediction of the future': ({'prediction_age_s': -0.3}, GuidanceStatus.STALE),
    'old pose': ({'pose_age_s': 0.3}, GuidanceStatus.STALE),
}


@pytest.mark.parametrize('case', DEAD_MAN)
@pytest.mark.parametrize('settings', [GuidanceConfig(), GuidanceConfig(f_max=20.0), GuidanceConfig(ramp_s=0.5)])
def test_every_dead_man_condition_releases_the_hand_within_the_ramp_and_a_blended_command_does_not_jump(case, settings):
    config, command = Config(guidance=settings), np.array([0.1, 0.0])
    state, given = build_guiding_state(Config(guidance=replace(settings, hold_s=5.0, k_max=5000.0, tank=10.0, clearance=0.0)))
    changes, status = DEAD_MAN[case]
    begin, sizes = given.t, [float(np.hypot(*state.force))]
    blended = [guide(config, state, given)[0].blend_command(command)]
    assert np.hypot(*(blended[0] - command)) > 0.01, 'guidance has no share'
    while given.t < begin + settings.ramp_s - 1e-9:
        given = replace(given, t=given.t + PERIOD, **changes)
        output, state = guide(config, state, given)
        sizes.append(float(np.hypot(*output.force)))
        blended.append(output.blend_command(command))
    assert output.status is status
    assert output.force.tolist() == [0.0, 0.0]
    assert (np.diff(sizes) <= 0.0).all() and np.abs(np.diff(sizes)).max() <= settings.slew * PERIOD * (1 + 1e-9)
    assert output.authority == 0.0 and blended[-1].tolist() == command.tolist()
    assert np.hypot(*np.diff(blended, axis=0).T).max() <= 0.1 * PERIOD / settings.ramp_s * (1 + 1e-9)


@pytest.mark.parametrize(
    ('before', 'now'),
    [
        ({}, {'slew': 1.0}),
        ({'ramp_s': 0.5}, {'ramp_s': 0.01, 'slew': 10.0}),
        ({'authority': 1.0, 'ramp_s': 0.5}, {'authority': 0.0, 'ramp_s': 0.1}),
    ],
    ids=['slew', 'ramp', 'authority'],
)
@pytest.mark.parametrize('ticks', [0, 4], ids=['with the release', 'during the release'])
def test_a_release_takes_no_longer_than_the_ramp_when_parameters_are_lowered(before, now, ticks):
    config = Config(guidance=GuidanceConfig(hold_s=5.0, k_max=5000.0, tank=10.0, clearance=0.0, **before))
    state, given = build_guiding_state(config)
    for _ in range(ticks):
        given = replace(given, t=given.t + PERIOD, is_released=True)
        _, state = guide(config, state, given)
    lowered, begin, sizes = Config(guidance=replace(config.guidance, **now)), given.t, []
    while given.t < begin + lowered.guidance.ramp_s - 1e-9:
        given = replace(given, t=given.t + PERIOD, is_released=True)
        output, state = guide(lowered, state, given)
        sizes.append((float(np.hypot(*output.force)), output.authority))
    assert sizes[0][0] > 0.0 and sizes[0][1] > 0.0, 'the force falls steadily'
    assert sizes[-1] == (0.0, 0.0) and (np.diff(sizes, axis=0) <= 0.0).all()


SAMPLES, PERIOD = 12, 0.005
HANDS = ('still', 'walks', 'flees', 'shakes', 'attacks', 'circles')


def random_scene(rng):
    """Return up to four posts and boxes round the origin."""
    n = int(rng.integers(0, 5))
    box = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    polygons = [rng.uniform(0.004, 0.03, 2) * box if rng.random() < 0.4 else np.zeros((1, 2)) for _ in range(n)]
    return make_obstacles(rng.uniform(-0.12, 0.12, (n, 2)), rng.uniform(0.003, 0.03, n), 0.0, polygons=polygons or None)


def random_candidate(rng, start, label):
    """Return a candidate along a smooth random path; every sixth one could not be solved."""
    base = outcome(label, float(rng.uniform(0.01, 1.0)))
    u = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    mean, covariance = np.zeros((SAMPLES, 6)), np.zeros((SAMPLES, 6, 6))
    mean[:, :2] = start + u * rng.normal(0.0, 0.2, 2) + u * (1 - u) * rng.normal(0.0, 0.3, 2)
    if rng.random() < 0.05:
        mean[:, :2] = start  # a path without any length
    factor = rng.normal(0.0, 10.0 ** rng.uniform(-6, 0), (SAMPLES, 2, 2))
    covariance[:, :2, :2] = factor @ factor.transpose(0, 2, 1)
    status = Status.INFEASIBLE if rng.random() < 1 / 6 else Status.SOLVED
    solution = replace(base.solution, mean=mean, covariance=covariance, status=status)
    return replace(base, solution=solution, likelihood=base.likelihood if status is Status.SOLVED else 0.0)


def random_prediction(rng, t, start, obstacles):
    """Return a prediction of up to four candidates, of which none needs to agree with another one, or with the hand."""
    names = rng.permutation(['goal0:', 'goal0:+0', 'goal0:-0', 'goal1:'])[: rng.integers(0, 5)]
    candidates = [random_candidate(rng, start + rng.normal(0.0, 0.02, 2), str(name)) for name in names]
    total = sum(each.likelihood for each in candidates) or 1.0
    candidates = [replace(each, likelihood=each.likelihood / total) for each in candidates]
    return prediction(*candidates, stamp_ns=round(t * 1e9), obstacles=obstacles)


@dataclass
class Run:
    """What happened: outputs and positions (n, 2) [m] of all updates."""

    config: GuidanceConfig
    obstacles: Obstacles
    outputs: list[GuidanceOutput] = field(default_factory=list)
    positions: list[Array] = field(default_factory=list)

    @property
    def forces(self):
        return np.array([each.force for each in self.outputs])

    def measure_extracted_energy(self):
        """Return the largest energy [J] that the hand has extracted until an update, of forces that are held in between."""
        return np.cumsum((self.forces[:-1] * np.diff(self.positions, axis=0)).sum(axis=1)).max(initial=0.0)

    def measure_force_into_margins(self):
        """Return the largest force [N] into a margin within 1 mm of it."""
        offsets, distances = measure_offsets(np.array(self.positions), self.obstacles)
        normals = offsets / np.where(distances == 0.0, 1.0, distances)[..., None]
        heights = distances - self.obstacles.radius - self.config.margin
        inward = -(normals * self.forces[:, None]).sum(axis=2)
        return inward[np.abs(heights) <= 0.001].max(initial=0.0)


def move(rng, kind, state, obstacles, speed):
    """Return where a hand goes within a period, at most at a speed."""
    step = speed * PERIOD
    if kind == 'still':
        return state.position
    if kind == 'flees':  # with the force, to extract what there is
        norm = float(np.hypot(*state.force))
        direction = state.force / norm if norm > 0.0 else rng.normal(0.0, 0.1, 2)
    elif kind == 'attacks' and len(obstacles):
        direction = obstacles.centre[0] - state.position
    elif kind == 'circles' and len(obstacles):
        x, y = state.position - obstacles.centre[0]
        direction = np.array([-y, x]) - 0.3 * np.array([x, y])
    elif kind == 'shakes':
        direction = np.array([1.0, 0.4]) * (1 if rng.random() < 0.5 else -1)
    else:
        direction = rng.normal(0.0, 1.0, 2)
    norm = float(np.hypot(*direction))
    return state.position + step * direction / max(norm, 1.0 if kind == 'flees' else norm, 1e-9)


def run_hostile(rng, ticks=24, *, has_jumps=False):
    """Run guidance on a hostile hand, with predictions that jump, vanish, arrive late and contradict each other.

    has_jumps: the hand jumps, and obstacles change, faster than any hand moves. Velocities are wrong in one run of three.
    """
    mode = 'path' if rng.random() < 0.5 else 'trajectory'
    settings = GuidanceConfig(
        mode=mode,
        tank=float(10.0 ** rng.uniform(-3, 0)),
        k_max=float(rng.uniform(50, 3000)),
        lookahead_s=float(rng.choice([0, 0.2])),
    )
    config, obstacles = Config(guidance=settings), random_scene(rng)
    run, state, newest = Run(settings, obstacles), GuidanceState(), None
    kind, is_wrong = str(rng.choice(HANDS)), rng.random() < 1 / 3
    position, t = rng.normal(0.0, 0.06, 2), 0.0
    for _ in range(ticks):
        if rng.random() < 0.3:
            late = rng.choice([0.0, 0.02, 1.0], p=[0.5, 0.4, 0.1])
            scene = random_scene(rng) if has_jumps and rng.random() < 0.3 else obstacles
            newest = None if rng.random() < 0.1 else random_prediction(rng, t - late, position, scene)
        velocity = rng.normal(0.0, 10.0 ** rng.uniform(-2, 4), 2) if is_wrong else (position - state.position) / PERIOD
        age = 0.0 if newest is None else t - newest.t
        acceleration = rng.normal(0.0, 2.0, 2)
        given = GuidanceInput(t, position, velocity, newest, 0.0, age, bool(rng.random() < 0.02), acceleration)
        output, state = guide(config, state, given)
        run.outputs.append(output)
        run.positions.append(position)
        position = move(rng, kind, state, obstacles, settings.max_speed)
        if has_jumps and rng.random() < 0.1:
            position = rng.normal(0.0, 10.0 ** rng.uniform(-2, 3), 2)
        t += PERIOD
    return run
