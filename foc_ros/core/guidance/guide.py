# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One update of guidance: references, stiffness, agreement, margins, limits and tank, in this order.

The force is the mean of what the candidates ask for, times its expected benefit to the operator.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foc_ros.core.config import Config, GuidanceConfig
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.prediction import Prediction
from foc_ros.core.support import check_vector
from foc_ros.core.types import Array, Record

from .limits import (
    NEAR_M,
    Margins,
    SeenMargins,
    build_margins,
    find_crossed,
    find_largest_force,
    limit_by_energy,
    measure_opposing_distance,
    release,
    see_margins,
    shorten,
    step_force,
    turn_along,
)
from .paths import (
    GuidePaths,
    advance_progress,
    build_paths,
    compute_stiffness,
    find_crossing,
    find_deflection,
    find_need,
    keep_clear,
    normalize,
    project_out,
    saturate,
    transfer_progress,
)

DOUBT = 0.25
"""Weight of the case that the operator wants none of the candidates: a certain candidate has 0.6 of its force at rest."""
EVIDENCE = 1.5
"""Acceleration of the hand along the force of a candidate that makes this candidate e times as likely [m/s^2]."""
LATE_PERIODS = 2.0
"""Longest time between two updates for which the tank is guaranteed, in periods of `guidance.rate_hz`."""

HEADING_M = 0.02
"""How far ahead on the paths a heading points at least [m]."""


class GuidanceStatus(StrEnum):
    """What guidance does. All but GUIDING are dead-man conditions, in which the force becomes zero within `guidance.ramp_s`.

    GUIDING: a force is computed. RELEASED: the clutch is open, the node is not active, or guidance is disabled. NO_PREDICTION:
    there is none, or none of its candidates has a likelihood. STALE: pose or prediction is older than `guidance.hold_s`.
    """

    GUIDING = 'guiding'
    RELEASED = 'released'
    NO_PREDICTION = 'no_prediction'
    STALE = 'stale'


@dataclass(frozen=True, eq=False)
class GuidanceInput(Record):
    """What one update is computed from.

    t: time of the update, of any clock that does not run backward [s]; position (2,) [m] and velocity (2,) [m/s] of the hand;
    prediction: the newest one, None if there is none. pose_age_s, prediction_age_s: time since the hand was measured, and since
    the stamp of the prediction [s]. is_released: whether guidance is switched off. acceleration (2,): of the hand [m/s^2].
    """

    t: float
    position: Array
    velocity: Array
    prediction: Prediction | None
    pose_age_s: float = 0.0
    prediction_age_s: float = 0.0
    is_released: bool = False
    acceleration: Array = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True, eq=False, repr=False)
class GuidanceOutput(Record):
    """The answer of one update.

    t: its time [s]; status; position (2,) [m]: of the hand; force (2,) [N]. reference (2,) [m] and stiffness (2, 2) [N/m]: an
    impedance with the same force at the present position, for controllers with a stiffness of their own. agreement in [0, 1]: of
    the candidates; authority in [0, 1]: share of guidance in a blended command; heading (2,): direction of that share, of at most
    unit length. tank: its content [J].
    """

    t: float
    status: GuidanceStatus
    position: Array
    force: Array
    reference: Array
    stiffness: Array
    agreement: float
    authority: float
    heading: Array
    tank: float

    def __repr__(self) -> str:
        """Say time, status, force and agreement."""
        x, y = self.force.tolist()
        return f'<GuidanceOutput t={self.t:g} s, {self.status}, force ({x:.3g}, {y:.3g}) N, agreement {self.agreement:.2f}>'

    def blend_command(self, command: ArrayLike) -> Array:
        """Return (1 - A) u + A |u| h (2,) for an operator's velocity command u (2,), the authority A and the heading h.

        It is never faster than the command, and equal to it where the authority is 0. InputError is raised for a wrong shape or
        a number that is not finite.
        """
        wanted = check_vector('command', command, 2)
        blended: Array = (1.0 - self.authority) * wanted + self.authority * float(np.hypot(*wanted)) * self.heading
        return blended


@dataclass(frozen=True, eq=False)
class Followed(Record):
    """The newest prediction as guidance uses it.

    paths: of its candidates, None if none has a likelihood; progress (c,): on them [m]; obstacles: as far as the hand has to keep
    away; margins, zones: of these, as large as force and clearance need them.
    """

    prediction: Prediction | None = None
    paths: GuidePaths | None = None
    progress: Array = field(default_factory=lambda: np.zeros(0))
    obstacles: Obstacles = field(default_factory=make_obstacles)
    margins: Margins = field(default_factory=lambda: build_margins(make_obstacles(), 0.0))
    zones: Margins = field(default_factory=lambda: build_margins(make_obstacles(), 0.0))


@dataclass(frozen=True, eq=False)
class GuidanceState(Record):
    """What the next update needs of this one.

    energy: content of the tank [J], None before the first update; t, position (2,), force (2,): of the last update; zero_t: by
    when a released force is zero [s], infinite while none is; share (2,): its authority in the direction of the paths.
    """

    energy: float | None = None
    t: float = 0.0
    zero_t: float = np.inf
    position: Array = field(default_factory=lambda: np.zeros(2))
    force: Array = field(default_factory=lambda: np.zeros(2))
    share: Array = field(default_factory=lambda: np.zeros(2))
    followed: Followed = field(default_factory=Followed)


@dataclass(frozen=True, eq=False)
class _Demand(Record):
    """What the candidates ask for, before the limits: force, stiffness, agreement.

    share (2,): the authority, in the direction of the paths.
    """

    force: Array = field(default_factory=lambda: np.zeros(2))
    stiffness: Array = field(default_factory=lambda: np.zeros((2, 2)))
    agreement: float = 0.0
    share: Array = field(default_factory=lambda: np.zeros(2))


def guide(config: Config, state: GuidanceState, given: GuidanceInput) -> tuple[GuidanceOutput, GuidanceState]:
    """Return the guidance of one update, and the state for the next one. Equal arguments give equal results.

    The time of an update is not before that of the last one. Force and slew keep their limits for every input; tank and margins
    are guaranteed for hands up to `guidance.max_speed`, updates not more than two periods apart, and obstacles that stand still.
    """
    settings = config.guidance
    dt = 0.0 if state.energy is None else given.t - state.t
    energy = settings.tank  # it pays for the work on the hand: E <- min(E - f . dx, E_max)
    if state.energy is not None:
        energy = min(state.energy - float(state.force @ (given.position - state.position)), settings.tank)
    status = find_status(settings, given)
    followed, demand = _follow_prediction(config, state.followed, given), _Demand()
    seen = see_margins(followed.margins, given.position)
    if status is GuidanceStatus.GUIDING and followed.paths is not None:
        progress = advance_progress(followed.paths, followed.progress, given.position, given.velocity, dt)
        followed = replace(followed, progress=progress)
        demand = _compute_demand(settings, followed, seen, given)
    find_bound = partial(_find_bound, settings, seen, energy)
    share_rate, zero_t = _find_share_rate(settings), np.inf
    if status is GuidanceStatus.GUIDING:
        counted = min(dt, LATE_PERIODS / settings.rate_hz)  # after a gap nothing rises suddenly
        force = step_force(state.force, demand.force, settings.slew * counted, find_bound)
        share = state.share + shorten(demand.share - state.share, counted * share_rate)
    else:
        zero_t = min(state.zero_t, state.t + settings.ramp_s)
        left = max(zero_t - given.t, 0.0) / max(zero_t - state.t, 1e-9)
        target = release(state.force, dt * find_largest_force(settings) / settings.ramp_s, left)
        change = max(settings.slew * dt, float(np.hypot(*(state.force - target))))
        force = step_force(state.force, target, change, find_bound)
        share = release(state.share, dt * share_rate, left)
    reference, authority = given.position + find_deflection(demand.stiffness, force), float(np.hypot(*share))
    output = GuidanceOutput(
        given.t, status, given.position, force, reference, demand.stiffness, demand.agreement, authority, normalize(share), energy
    )
    return output, GuidanceState(energy, given.t, zero_t, given.position, force, share, followed)


def find_status(settings: GuidanceConfig, given: GuidanceInput) -> GuidanceStatus:
    """Return whether there is a dead-man condition, and which."""
    if given.is_released:
        return GuidanceStatus.RELEASED
    if given.prediction is None or not given.prediction.candidates_with_likelihood:
        return GuidanceStatus.NO_PREDICTION
    if max(given.pose_age_s, abs(given.prediction_age_s)) > settings.hold_s:
        return GuidanceStatus.STALE
    return GuidanceStatus.GUIDING


def _follow_prediction(config: Config, before: Followed, given: GuidanceInput) -> Followed:
    """Return paths, progress and margins of the given prediction; those before if it is none or the same."""
    prediction = given.prediction
    if prediction is None or prediction is before.prediction:
        return before
    obstacles = prediction.blocking_obstacles.grow(config.scene.hand_radius)
    margins, zones = (build_margins(obstacles, growth) for growth in (config.guidance.margin, config.guidance.clearance))
    if not prediction.candidates_with_likelihood:
        return Followed(prediction, obstacles=obstacles, margins=margins, zones=zones)
    paths, references = build_paths(prediction), {}
    if before.paths is not None:
        points = before.paths.interpolate(before.paths.points, before.paths.locate(before.progress))
        references = dict(zip(before.paths.labels, points, strict=True))
    travelled = float(np.hypot(*given.velocity)) * max(given.prediction_age_s, 0.0)
    progress = transfer_progress(paths, references, given.position, travelled)
    return Followed(prediction, paths, progress, obstacles, margins, zones)


def _compute_demand(settings: GuidanceConfig, followed: Followed, seen: SeenMargins, given: GuidanceInput) -> _Demand:
    """Return what the candidates ask for.

    A prediction begins at the hand, so what distinguishes a path from the movement of the hand is ahead of both. With the
    look-ahead h of `paths.find_need`, x_i is the point of path i that is |v| h farther than the progress, and it is compared
    with where the hand is by then, if it keeps its velocity v:

        f_i = K_i (x_i - (x + h v)).

    In mode `path` there is no force along the direction of the hand, which is that of the path where the hand is at rest. Near
    the end of a path, h is the time to its end. With h = 0 this is f_i = K_i (x_i - x).
    """
    prediction, paths, progress = followed.prediction, followed.paths, followed.progress
    speed = float(np.hypot(*given.velocity))
    assert prediction is not None and paths is not None
    need = find_need(settings, followed.zones, given.position, given.velocity)
    ahead = np.minimum(progress + need.time_s * speed, paths.lengths[:, -1])
    times = np.minimum(need.time_s, (ahead - progress) / max(speed, 1e-9))
    places = paths.locate(ahead)
    stiffness = compute_stiffness(paths.interpolate(paths.covariances, places), settings)
    if settings.mode == 'path':
        # from 20 mm/s on, the direction of the hand counts more than that of the path
        stiffness = project_out(stiffness, normalize(given.velocity + 0.02 * paths.find_tangents(progress)))
    points = keep_clear(settings, followed.obstacles, paths.interpolate(paths.points, places))
    errors = saturate(settings, points - given.position - times[:, None] * given.velocity, need.share)
    forces = (stiffness @ errors[..., None])[..., 0]
    weights = weigh_candidates(paths.likelihoods, forces, given.acceleration, prediction.unknown, prediction.other)
    force, agreement = combine(weights, forces, find_crossing(need, errors))
    places = paths.locate(np.maximum(ahead, progress + HEADING_M))
    heading = paths.likelihoods @ normalize(paths.interpolate(paths.points, places) - given.position)
    # as for the force, the part into a margin is so small that it can be zero when the hand is there
    most = _find_share_rate(settings) * np.maximum(seen.distance.min(axis=1) - NEAR_M, 0.0) / settings.max_speed
    return _Demand(
        turn_along(seen, np.where(find_crossed(seen, weights @ errors), 0.0, np.inf), force),
        need.share * agreement * np.einsum('c,cab->ab', paths.likelihoods, stiffness),
        agreement,
        turn_along(seen, most, settings.authority * shorten(heading, 1.0)),
    )


def _find_share_rate(settings: GuidanceConfig) -> float:
    """Return the largest rate of change of the share of guidance [1/s]: a released share is zero within `ramp_s`.

    A blended command changes at twice this rate at most, relative to its size. With an authority up to 0.5, that is by its size
    within `ramp_s`.
    """
    return max(settings.authority, 0.5) / settings.ramp_s


def _find_bound(settings: GuidanceConfig, seen: SeenMargins, energy: float, force: Array) -> float:
    """Return the largest size [N] of a force in a direction (2,): by its limits, the tank and the margins.

    At the distance D there is a margin into which the force leads. A hand at the speed w is there after D / w. The force has to
    be so small that the slew limit r makes it zero by then: |f| <= r (D - d) / w, with the distance d of `NEAR_M`.
    """
    slew, speed = settings.slew, settings.max_speed
    distance = measure_opposing_distance(seen, force)
    by_tank = limit_by_energy(energy, slew, speed, LATE_PERIODS / settings.rate_hz)
    return max(min(find_largest_force(settings), by_tank, slew * (distance - NEAR_M) / speed), 0.0)


def weigh_candidates(likelihoods: Array, forces: Array, acceleration: Array, unknown: float = 0.0, other: float = 0.0) -> Array:
    """Return the probability w_i (c,) that the operator wants candidate i, given the acceleration of the hand.

    An operator who wants another way accelerates towards it before the likelihoods p_i follow. With the direction n_i of the
    force of candidate i (c, 2) [N], and the acceleration a (2,) [m/s^2],

        w_i ~ p_i exp(a . n_i / A),

    where A is `EVIDENCE`. The rest is the probability that the operator wants none of them, a case that has the weight u + o + D:
    the share u that is unknown, the share o of another goal, and D, which is `DOUBT`.
    """
    logs = np.clip(normalize(forces) @ acceleration / EVIDENCE, -50.0, 50.0)  # beyond, a candidate has all or nothing
    weights = likelihoods * np.exp(logs)
    probabilities: Array = weights / (float(weights.sum()) + unknown + other + DOUBT)
    return probabilities


def combine(weights: Array, forces: Array, is_idle: NDArray[np.bool_]) -> tuple[Array, float]:
    """Return the force f (2,) [N] and the agreement a in [0, 1] of forces f_i (c, 2) [N] with probabilities w_i (c,).

    The direction is that of s = sum_i w_i b_i f_i: candidates that are idle (c,) give no force, b_i = 0, and b_i = 1 otherwise. A
    force there helps with the probability P of the candidates that pull to this side, and opposes the operator with 1 - P. It is
    their mean times its expected benefit, and vanishes where that is not positive:

        f = a s / P,   a = max(P - (1 - P), 0),   P = sum of w_i over b_i f_i . s > 0.

    Where none pulls, a is 1.
    """
    pulls = np.where(is_idle[:, None], 0.0, forces)
    total = weights @ pulls
    if not total.any():
        return total, float(not pulls.any())
    helping = float(weights[pulls @ total > 0.0].sum())
    agreement = max(2.0 * helping - 1.0, 0.0)
    return agreement / helping * total, agreement
