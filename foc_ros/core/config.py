# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every parameter with its default, bounds, unit and meaning, in one place.

ROS parameters (`foc_ros.ros.parameters`), `config/foc.yaml` and the documentation are derived from these classes. A
nested class is a group: `likelihood.beta` is `Config().likelihood.beta`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from operator import attrgetter
from typing import TYPE_CHECKING, cast

from .errors import ParameterError, join_errors
from .parameter import Group, Parameter, check_fields, check_value, param
from .registry import LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES
from .removed import find_parameter, guard_parameters

PLANES = ('xy', 'xz', 'yz')
ARRIVALS = ('rest', 'passing')
ONLINE = 'online'
ADAPTATIONS = ('none', ONLINE)
MOST_CANDIDATES = 64
"""Largest number of homotopy classes that are solved in one prediction."""
WIDENS = 'widens the predicted covariance, not the chance constraint'
REFERENCE_STEP_S = 0.02
"""Step for which the noise parameters are quoted (doc/model.md): c is scaled by sqrt(0.02 / dt)."""
WHOLE_WAY_S = 1000.0
"""Planning horizon of operators who plan the whole way [s]."""


@dataclass(frozen=True)
class FocConfig(Group):
    """The forward optimal control."""

    steps: int = param(30, 'number of control steps N of the horizon', '', 5, 400)
    eta: float = param(0.9, 'wanted probability of avoidance, of what `foc.risk` names', '', 0.0, 0.999)
    bound: str = param(
        'cantelli',
        'what turns eta into standard deviations: it holds for any distribution, or for a Gaussian one',
        choices=('cantelli', 'gaussian'),
    )
    risk: str = param(
        'step', 'what eta is about: each obstacle at each step, or all obstacles along the whole path', choices=('step', 'path')
    )
    strategy: str = param('optimal', 'how the solver trades clearance against precision', choices=STRATEGIES)
    plant: str = param('triple_integrator', 'dynamic model of the hand that the control moves', choices=PLANTS)
    plant_mass: float = param(1.0, 'mass of the plant damped_mass', 'kg', 1e-3, 1e3)
    plant_damping: float = param(2.0, 'viscous damping of the plant damped_mass', 'N s/m', 0.0, 1e4)
    noise_x: float = param(0.05, 'motor noise per unit of control along the first axis, at a step of 0.02 s', '', 0.0, 2.0)
    noise_y: float = param(0.05, 'motor noise per unit of control along the second axis, at a step of 0.02 s', '', 0.0, 2.0)
    process_noise: float = param(
        0.0, f'root of the spectral density of unplanned control, which {WIDENS}; N s^0.5 for damped_mass', 'm/s^2.5', 0.0, 1e3
    )
    endpoint_stddev: float = param(
        0.03, f'standard deviation of end points about their goal, per axis; it {WIDENS}', 'm', 0.0, 1.0
    )
    lv_delta: float = param(5e-5, 'tau per unit of s for strategy lv, and per step of algorithm1 (delta)', 'm^2', 0.0, 1.0)
    hc_delta: float = param(1e-4, 'tau per unit of s for strategy hc', 'm^2', 0.0, 1.0)
    growth: float = param(2.0, 'factor on lambda per unit of s (Delta)', '', 1.0001, 1e6)
    tau: float = param(0.0, 'clearance term tau of strategy fixed', 'm^2', 0.0, 100.0)
    lam: float = param(1.0, 'variance weight lambda of strategy fixed, and the first lambda of lv and hc', '', 0.0, 1e15)
    algorithm1_growth: float = param(10.0, 'factor on lambda per step of strategy algorithm1 (Delta)', '', 1.0, 1e6)
    goal_weight: float = param(0.0, 'weight of the position variance at the goal, in effort per m^2', '1/s^6', 0.0, 1e15)
    recovery_s: float = param(0.2, 'time within which a hand inside the margin of an obstacle has to leave it', 's', 0.0, 10.0)
    qp_backend: str = param(
        'piqp', 'QP solver: piqp, a solver of qpsolvers by its name, or a registered one', choices=QP_BACKENDS
    )


@dataclass(frozen=True)
class DurationConfig(Group):
    """Duration of the movement, and how it ends."""

    model: str = param('fitts', 'duration of a movement: fixed, or by Fitts law', choices=('fixed', 'fitts'))
    fixed_s: float = param(1.0, 'duration of model fixed', 's', 0.05, 60.0)
    fitts_a_s: float = param(0.2, 'intercept of Fitts law', 's', 0.0, 60.0)
    fitts_b_s: float = param(0.25, 'slope of Fitts law, per bit', 's', 0.0, 60.0)
    target_width: float = param(0.02, 'target width of Fitts law', 'm', 1e-4, 10.0)
    adaptation: str = param(
        'online', "whether expected durations and `arrival` follow the operator's movements", choices=ADAPTATIONS
    )
    spread: float = param(0.4, f'standard deviation of the time to go, as a fraction of it; it {WIDENS}', '', 0.0, 2.0)
    wait_s: float = param(0.0, f'mean time until a hand at rest starts to move; it {WIDENS}', 's', 0.0, 60.0)
    arrival: str = param('rest', 'how the hand arrives at its goal: it comes to rest, or passes at any speed', choices=ARRIVALS)


@dataclass(frozen=True)
class CovarianceConfig(Group):
    """Factors on the predicted standard deviations."""

    near: float = param(1.0, 'factor on the standard deviations of predicted positions, for those at once', '', 0.01, 100.0)
    far: float = param(
        1.0, 'the same at the end of each candidate; its logarithm changes with the square of the time', '', 0.01, 100.0
    )
    adaptation: str = param(
        'online', 'whether both factors are multiplied by factors that are learnt from earlier errors', choices=ADAPTATIONS
    )


@dataclass(frozen=True)
class EstimatorConfig(Group):
    """The Kalman filter of the hand."""

    position_stddev: float = param(0.001, 'standard deviation of a measured position', 'm', 1e-7, 1.0)
    jerk_density: float = param(5.0, 'root of the spectral density of the jerk that the filter expects', 'm/s^2.5', 1e-6, 1e6)
    onset_speed: float = param(0.05, 'speed above which a movement begins; it ends below half of this speed', 'm/s', 1e-4, 10.0)
    acceleration_time_s: float = param(
        0.02, 'decay time of an acceleration: predictions start at the speed that it leads to; 0: no decay', 's', 0.0, 10.0
    )
    min_interval_s: float = param(
        0.0035,
        'time after a pose that was used, by stamps, within which node and replay skip others; 0: they skip none',
        's',
        0.0,
        0.1,
    )
    gap_s: float = param(0.5, 'gap between samples after which the filter restarts', 's', 0.001, 60.0)
    hand_timeout_s: float = param(
        0.5, 'timeout after which a missing or stale hand pose stops prediction; 0: never', 's', 0.0, 1e6
    )


@dataclass(frozen=True)
class HomotopyConfig(Group):
    """Homotopy classes that are considered."""

    max_candidates: int = param(
        24, 'largest number of homotopy classes to solve, over all goals; each goal gets at least one', '', 1, MOST_CANDIDATES
    )
    max_detour: float = param(1.5, 'length of the longest class to solve, relative to the shortest one to its goal', '', 1.0, 1e6)
    clearance: float = param(0.005, 'distance that the hand needs from every obstacle: narrower gaps are closed', 'm', 0.0, 1.0)
    library: str = param('', 'file of paths that learn or replay --learn wrote; empty: none', read_only=True)


@dataclass(frozen=True)
class LikelihoodConfig(Group):
    """Conversion of costs to likelihoods."""

    rule: str = param('cost_ratio', 'rule that gives the weight of a class from its cost', choices=LIKELIHOOD_RULES)
    beta: float = param(2.0, 'exponent of the cost ratio', '', 0.0, 100.0)
    shortfall: float = param(
        6.0, 'log-likelihood that a class loses per standard deviation below the wanted eta; .inf: left out', '', 0.0, math.inf
    )
    planning_horizon_s: float = param(
        3.0, 'time to the goal beyond which an operator looks ahead (lookahead_s); 0: always; 1000: never', 's', 0.0, WHOLE_WAY_S
    )
    lookahead_s: float = param(
        0.5, 'mean look-ahead of an operator who looks ahead: beta decays with the time to a choice; 0: no decay', 's', 0.0, 60.0
    )
    weaving: float = param(
        4.0, 'log-likelihood that a class loses for each row through several gaps of which it leads', '', 0.0, 100.0
    )
    other_goal: float = param(
        0.02, 'probability, before the hand has moved, that it will go to a goal that nobody announced', '', 0.0, 0.99
    )
    past_goals: float = param(
        1.0, 'by how much each earlier reach counts for or against the goals that were announced; 0: not at all', '', 0.0, 100.0
    )


@dataclass(frozen=True)
class ExperienceConfig(Group):
    """Use of recordings as evidence: those in the class library (`homotopy.library`), and those that are learnt."""

    learning: str = param(
        'goals',
        'what movements that end at a goal say of later ones in the running program: nothing; paths and goals; also ways',
        choices=('none', 'goals', ONLINE),
    )


@dataclass(frozen=True)
class SceneConfig(Group):
    """Use of the scene topics."""

    timeout_s: float = param(
        2.0, 'age of obstacles, by stamp and in the node by arrival, after which prediction stops; 0: never', 's', 0.0, 1e6
    )
    max_obstacles: int = param(64, 'number of obstacles to consider: those farthest from the paths are left out', '', 1, 4096)
    marker_radius_stddev: float = param(
        0.0, 'standard deviation of the radius of obstacles from markers, collision objects and detections', 'm', 0.0, 1.0
    )
    hand_radius: float = param(0.0, 'added to the radius of every obstacle: hands and tools are not points', 'm', 0.0, 1.0)


@dataclass(frozen=True)
class FramesConfig(Group):
    """Transforms of messages that are in another frame than the working frame."""

    tolerance_s: float = param(
        0.1, 'time to wait for the transform at the stamp of a message, and largest age of another one then', 's', 0.0, 10.0
    )


@dataclass(frozen=True)
class GuidanceConfig(Group):
    """The guiding force: `core/guidance`."""

    enabled: bool = param(False, 'whether the node publishes guidance; without it the node is a predictor only')
    rate_hz: float = param(200.0, 'updates of guidance per second, independent of the predictions', 'Hz', 1.0, 1000.0)
    realtime_priority: int = param(
        50, 'priority of the thread of guidance under SCHED_FIFO, while it is enabled and if permitted; 0: ordinary', '', 0, 99
    )
    mode: str = param(
        'path',
        'path: no force along the path, the operator sets the pace; trajectory: also along it',
        choices=('path', 'trajectory'),
    )
    k_max: float = param(150.0, 'largest stiffness in any direction', 'N/m', 0.0, 5000.0)
    f_max: float = param(3.0, 'largest force; it is also at most what `slew` reduces to zero within `ramp_s`', 'N', 0.0, 100.0)
    slew: float = param(300.0, 'largest rate of change of the force', 'N/s', 0.1, 1e5)
    lookahead_s: float = param(
        0.3, 'longest time ahead at which a path is compared with where the hand goes by its velocity', 's', 0.0, 2.0
    )
    clearance: float = param(
        0.012, 'distance that guidance keeps the hand from obstacles: no force farther away; 0: force everywhere', 'm', 0.0, 1.0
    )
    margin: float = param(0.002, 'distance from every obstacle within which no force leads towards it', 'm', 0.0, 1.0)
    tank: float = param(0.5, 'energy tank: most energy that guidance gives; the clutch fills it again', 'J', 0.0, 1e3)
    max_speed: float = param(1.0, 'speed of the fastest hand, for which tank and margins are guaranteed', 'm/s', 0.01, 100.0)
    hold_s: float = param(0.25, 'age of the newest pose or prediction after which the force is released', 's', 0.001, 10.0)
    ramp_s: float = param(0.1, 'time within which a released force becomes zero', 's', 0.001, 10.0)
    unstamped: bool = param(
        False, 'whether the force is also published without a stamp, on `~/guidance/wrench_unstamped`', read_only=True
    )
    authority: float = param(0.5, 'largest share of guidance in `~/guidance/twist`', '', 0.0, 1.0)


@dataclass(frozen=True)
class Config:
    """All parameters of the predictor and of guidance.

    Groups of parameters are fields of this class: ``Config().foc.eta`` is the parameter ``foc.eta``. A config is frozen;
    `with_values` returns a changed one. The page `parameters` of the documentation lists names, bounds, units and meanings.

    Examples
    --------
    >>> import foc_ros
    >>> config = foc_ros.Config().with_values({'foc.eta': 0.95, 'rate_hz': 20.0})
    >>> config
    <Config rate_hz=20.0, foc.eta=0.95>
    >>> config.foc.eta
    0.95

    The same for one group, given as a whole or by the values that differ from the defaults:

    >>> foc_ros.Config(rate_hz=20.0, foc={'eta': 0.95})
    <Config rate_hz=20.0, foc.eta=0.95>
    """

    rate_hz: float = param(50.0, 'predictions per second of message time', 'Hz', 0.1, 1000.0)
    budget_s: float = param(
        0.01, 'time limit of a live prediction, whose best answer by then counts; replays have none; 0: none', 's', 0.0, 60.0
    )
    plane: str = param('xy', 'task plane of the working frame', choices=PLANES, read_only=True)
    frame_id: str = param('', 'working frame; empty: the frame of the first hand pose', read_only=True)
    predict_height: bool = param(
        True, "whether the height over the plane moves to that of the goal; without it the hand's height is predicted to stay"
    )
    foc: FocConfig = field(default_factory=FocConfig)
    duration: DurationConfig = field(default_factory=DurationConfig)
    covariance: CovarianceConfig = field(default_factory=CovarianceConfig)
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    homotopy: HomotopyConfig = field(default_factory=HomotopyConfig)
    likelihood: LikelihoodConfig = field(default_factory=LikelihoodConfig)
    experience: ExperienceConfig = field(default_factory=ExperienceConfig)
    scene: SceneConfig = field(default_factory=SceneConfig)
    frames: FramesConfig = field(default_factory=FramesConfig)
    guidance: GuidanceConfig = field(default_factory=GuidanceConfig)

    if TYPE_CHECKING:  # a group may be given as a mapping, which the types of the fields do not say

        def __init__(
            self, *, rate_hz: float = ..., budget_s: float = ..., plane: str = ..., frame_id: str = ...,
            predict_height: bool = ..., **groups: Group | Mapping[str, object],
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        """Take a mapping as a group of these values; raise ParameterError for anything that is no value of its parameter."""
        for item in fields(self):
            given = getattr(self, item.name)
            if 'bound' in item.metadata or isinstance(given, cast('type', item.default_factory)):
                continue
            if not isinstance(given, Mapping):
                raise ParameterError(item.name, 'a mapping of its parameters to their values', repr(given))
            defaults = replace_values(Config(), {f'{item.name}.{name}': value for name, value in given.items()})
            vars(self)[item.name] = getattr(defaults, item.name)
        vars(self).update(check_fields(self))

    def __repr__(self) -> str:
        """Name the parameters that differ from their defaults."""
        defaults = {parameter.name: parameter.default for parameter in list_parameters()}
        changed = [f'{name}={value!r}' for name, value in flatten(self).items() if value != defaults[name]]
        return f'<Config {", ".join(changed) or "of defaults"}>'

    def with_values(self, values: Mapping[str, object]) -> Config:
        """Return the config with other values, by dotted name such as ``'foc.eta'``.

        Raises
        ------
        ParameterError
            For an unknown name, a wrong type or a value out of bounds; it names the parameter, the value and the bound.

        Examples
        --------
        >>> import foc_ros
        >>> foc_ros.Config().with_values({'foc.eta': 1.5})
        Traceback (most recent call last):
        foc_ros.core.errors.ParameterError: foc.eta: expected a number in [0, 0.999], got 1.5
        """
        return replace_values(self, values)


def list_parameters(group: type = Config, prefix: str = '') -> Iterator[Parameter]:
    """Yield every parameter of a config class, depth first, by dotted name."""
    for item in fields(group):
        if 'bound' in item.metadata:
            yield Parameter(prefix + item.name, item.default, item.metadata['bound'])
        else:
            yield from list_parameters(cast('type', item.default_factory), f'{prefix}{item.name}.')


def flatten(config: Config) -> dict[str, float | int | str | bool]:
    """Return every value by dotted name."""
    return {parameter.name: attrgetter(parameter.name)(config) for parameter in list_parameters()}


def replace_values(config: Config, values: Mapping[str, object]) -> Config:
    """Return the config with some values changed, by dotted name: `Config.with_values`. An error names all wrong values."""
    known = {parameter.name: parameter for parameter in list_parameters()}
    errors = []
    for name, value in values.items():
        group, _, leaf = name.rpartition('.')
        try:
            checked = check_value(find_parameter(name, value, known), value)
        except ParameterError as error:
            errors.append(error)
            continue
        config = replace(config, **({group: replace(getattr(config, group), **{leaf: checked})} if group else {leaf: checked}))
    if errors:
        raise join_errors(errors)
    return config


for _kind in cast('list[type]', [Config, *Group.__subclasses__()]):
    guard_parameters(_kind, {each.name: each for each in list_parameters()})
