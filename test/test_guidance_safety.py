# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Safety of guidance as properties: bounds, slew, release, passivity and margins, for hostile hands and predictions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from guidance_samples import PERIOD, random_candidate, run_hostile
from prediction_samples import prediction

from foc_ros.core.config import Config, GuidanceConfig
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceState, GuidanceStatus, guide
from foc_ros.core.guidance.limits import find_largest_force

FEW, BATCH, BATCHES = 200, 2500, 4


def check_bounds(run) -> None:
    forces, settings = run.forces, run.config
    assert np.isfinite(forces).all()
    assert np.hypot(*forces.T).max() <= settings.f_max * (1 + 1e-9)
    slews = np.hypot(*np.diff(forces, axis=0).T) / np.diff(run.times)
    assert slews.max() <= settings.slew * (1 + 1e-6)
    for output in run.outputs:
        values, asymmetry = np.linalg.eigvalsh(output.stiffness), output.stiffness - output.stiffness.T
        assert values.min() >= -1e-6 and values.max() <= settings.k_max * (1 + 1e-9) and np.abs(asymmetry).max() < 1e-6
        assert 0.0 <= output.agreement <= 1.0 and 0.0 <= output.authority <= settings.authority


def check_hand_of_limited_speed(run) -> None:
    assert run.measure_extracted_energy().max() <= run.config.tank + 1e-12
    assert run.measure_force_into_margins().max() <= 1e-9


def check_many(seeds: range) -> None:
    """Check hostile hands, half of which jump and so have no speed for which tank and margins are guaranteed."""
    extracted = near = 0
    for seed in seeds:
        has_jumps = seed % 2 == 1
        run = run_hostile(np.random.default_rng(seed), has_jumps=has_jumps)
        check_bounds(run)
        if not has_jumps:
            check_hand_of_limited_speed(run)
            extracted += run.measure_extracted_energy().max() > 0.1 * run.config.tank
            near += bool(run.forces.any())
    assert extracted > len(seeds) / 100, 'hardly any hand extracts energy: the test is too kind'
    # an eighth of all; by chance, one batch has fewer than others
    assert near > len(seeds) / 10, 'hardly any hand feels a force: the test is too kind'


def test_hostile_hands() -> None:
    check_many(range(FEW))


@pytest.mark.parametrize('batch', range(BATCHES))
def test_ten_thousand_hostile_hands(batch: int) -> None:
    check_many(range(BATCH * batch, BATCH * (batch + 1)))


def build_guiding_state(config: Config, seed: int = 3) -> tuple[GuidanceState, GuidanceInput]:
    """Return a state with a force near the largest one."""
    rng = np.random.default_rng(seed)
    candidate = random_candidate(rng, np.zeros(2), 'goal0:')
    mean = candidate.mean.copy()
    mean[:, :2] = np.column_stack([np.linspace(0.0, 0.3, len(mean)), np.full(len(mean), 0.05)])
    solution = replace(candidate.solution, mean=mean, covariance=np.zeros((len(mean), 6, 6)))
    newest = prediction(replace(candidate, solution=solution, likelihood=1.0), stamp_ns=0)
    state = GuidanceState()
    given = GuidanceInput(0.0, np.zeros(2), np.zeros(2), newest)
    for tick in range(60):
        given = replace(given, t=PERIOD * tick)
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
def test_every_dead_man_condition_releases_the_hand_within_the_ramp(case: str, settings: GuidanceConfig) -> None:
    config = Config(guidance=settings)
    state, given = build_guiding_state(Config(guidance=replace(settings, hold_s=5.0, k_max=5000.0, tank=10.0, clearance=0.0)))
    changes, status = DEAD_MAN[case]
    begin, sizes = given.t, [float(np.hypot(*state.force))]
    while given.t < begin + settings.ramp_s - 1e-9:
        given = replace(given, t=given.t + PERIOD, **changes)
        output, state = guide(config, state, given)
        sizes.append(float(np.hypot(*output.force)))
    assert output.status is status
    assert output.force.tolist() == [0.0, 0.0]
    assert (np.diff(sizes) <= 0.0).all() and np.abs(np.diff(sizes)).max() <= settings.slew * PERIOD * (1 + 1e-9)
    assert output.authority == 0.0
