"""Every parameter with its default, bounds, unit and meaning, in one place.

ROS parameters (`foc_ros.ros.parameters`), `config/foc.yaml` and the documentation are derived from these classes. A
nested class is a group: `likelihood.beta` is `Config().likelihood.beta`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, cast

from .errors import ParameterError

STRATEGIES = ('lv', 'hc', 'optimal', 'algorithm1', 'fixed')
PLANES = ('xy', 'xz', 'yz')
DURATION_MODELS = ('fixed', 'fitts', 'cost_of_time')
ARRIVALS = ('rest', 'passing')
MOST_CANDIDATES = 64
"""Most homotopy classes that are ever solved in one prediction."""
REFERENCE_STEP_S = 0.02
"""Step for which the node's noise is quoted (doc/model.md): c is scaled by sqrt(0.02 / dt)."""


@dataclass(frozen=True)
class Bound:
    """What a parameter may be: kind of value, closed range, choices; unit and meaning for descriptors and documents."""

    low: float | None = None
    high: float | None = None
    unit: str = ''
    meaning: str = ''
    choices: tuple[str, ...] = ()
    read_only: bool = False


def _p(default: Any, meaning: str, unit: str = '', low: float | None = None, high: float | None = None, **rest: Any) -> Any:
    return field(default=default, metadata={'bound': Bound(low, high, unit, meaning, **rest)})


@dataclass(frozen=True)
class FocConfig:
    """The forward optimal control."""

    steps: int = _p(50, 'number of control steps N of the horizon', '', 5, 400)
    eta: float = _p(0.9, 'wanted probability of avoiding each obstacle at each step', '', 0.0, 0.999)
    strategy: str = _p('lv', 'how clearance and precision are traded', choices=STRATEGIES)
    noise_x: float = _p(0.05, 'noise per unit of jerk along the first axis of the plane, at a step of 0.02 s', '', 0.0, 2.0)
    noise_y: float = _p(0.05, 'the same along the second axis', '', 0.0, 2.0)
    process_noise: float = _p(
        0.0,
        'root of the spectral density of jerk beside any plan: widens what is predicted, no part of the chance constraint',
        'm/s^2.5',
        0.0,
        1e3,
    )
    endpoint_stddev: float = _p(
        0.0,
        'standard deviation, along each axis, of where movements end about their goal: widens what is predicted alone',
        'm',
        0.0,
        1.0,
    )
    lv_delta: float = _p(5e-5, 'tau per unit of s for strategy lv', 'm^2', 0.0, 1.0)
    hc_delta: float = _p(1e-4, 'tau per unit of s for strategy hc', 'm^2', 0.0, 1.0)
    growth: float = _p(2.0, 'factor on lambda per unit of s (Delta)', '', 1.0001, 1e6)
    tau: float = _p(0.0, 'clearance term of strategy fixed', 'm^2', 0.0, 100.0)
    lam: float = _p(1.0, 'variance weight of strategy fixed, first lambda of the others', '', 0.0, 1e15)
    algorithm1_delta: float = _p(5e-5, 'step of tau in strategy algorithm1 (delta)', 'm^2', 0.0, 1.0)
    algorithm1_growth: float = _p(10.0, 'factor on lambda per step of strategy algorithm1 (Delta)', '', 1.0, 1e6)
    algorithm1_xi: float = _p(1.0, 'change of effort at which strategy algorithm1 ends (xi)', 'm^2/s^6', 0.0, 1e12)
    goal_weight: float = _p(0.0, 'weight of the position variance at the goal, in effort per m^2', '1/s^6', 0.0, 1e15)
    recovery_s: float = _p(0.2, 'time in which a hand inside a margin has to be out of it', 's', 0.0, 10.0)


@dataclass(frozen=True)
class DurationConfig:
    """How long the movement takes, and how it ends."""

    model: str = _p(
        'fitts', 'duration of a movement: fixed, by Fitts law, or what is best where time has a cost', choices=DURATION_MODELS
    )
    fixed_s: float = _p(1.0, 'duration of model fixed', 's', 0.05, 60.0)
    fitts_a_s: float = _p(0.2, 'intercept of Fitts law', 's', 0.0, 60.0)
    fitts_b_s: float = _p(0.25, 'slope of Fitts law, per bit', 's', 0.0, 60.0)
    target_width: float = _p(0.02, 'target width of Fitts law', 'm', 1e-4, 10.0)
    time_cost: float = _p(100.0, 'cost of time of model cost_of_time: a longer way takes longer', 'm^2/s^6', 1e-9, 1e9)
    min_time_to_go_s: float = _p(0.3, 'floor of the time to go', 's', 0.01, 60.0)
    spread: float = _p(
        0.0,
        'standard deviation of the time to go, as a share of it: widens what is predicted alone',
        '',
        0.0,
        2.0,
    )
    wait_s: float = _p(0.0, 'mean time that a hand at rest waits: widens what is predicted of it alone', 's', 0.0, 60.0)
    arrival: str = _p('rest', 'how the hand comes to its goal: to rest, or passing it at any speed', choices=ARRIVALS)
    max_time_to_go_s: float = _p(10.0, 'ceiling of the time to go', 's', 0.05, 120.0)


@dataclass(frozen=True)
class EstimatorConfig:
    """The Kalman filter of the hand."""

    position_stddev: float = _p(0.001, 'standard deviation of a measured position', 'm', 1e-7, 1.0)
    jerk_density: float = _p(5.0, 'root of the spectral density of the jerk that the filter expects', 'm/s^2.5', 1e-6, 1e6)
    onset_speed: float = _p(0.05, 'speed above which a movement has begun; it has ended below half of it', 'm/s', 1e-4, 10.0)
    acceleration_time_s: float = _p(
        0.0,
        'time in which an acceleration fades: predictions start at the speed it leads to; 0: with the acceleration',
        's',
        0.0,
        10.0,
    )
    gap_s: float = _p(0.5, 'gap between samples beyond which the filter starts anew', 's', 0.001, 60.0)
    hand_timeout_s: float = _p(
        0.5, 'silence of the hand, or age of a pose, in the node beyond which nothing is predicted; 0: never', 's', 0.0, 1e6
    )


@dataclass(frozen=True)
class HomotopyConfig:
    """Which ways round are considered."""

    max_candidates: int = _p(4, 'number of homotopy classes solved, over all goals; at least one to each', '', 1, MOST_CANDIDATES)
    clearance: float = _p(0.005, 'distance from an obstacle that the hand needs: a narrower gap is closed', 'm', 0.0, 1.0)
    library: str = _p('', 'file of demonstrated ways that replay --learn wrote; empty: none', read_only=True)


@dataclass(frozen=True)
class LikelihoodConfig:
    """From costs to likelihoods."""

    beta: float = _p(0.5, 'exponent of the cost ratio', '', 0.0, 100.0)
    spent_share: float = _p(1.0, 'share of the effort spent since onset that is part of every cost', '', 0.0, 1.0)
    lookahead_s: float = _p(
        0.0,
        'mean time that the operator looks ahead: beta fades with the time until a choice; 0: without end',
        's',
        0.0,
        60.0,
    )
    margin: float = _p(0.05, 'lead in likelihood at which the most likely class changes', '', 0.0, 1.0)


@dataclass(frozen=True)
class SceneConfig:
    """What is taken from the scene topics."""

    timeout_s: float = _p(
        2.0,
        'age of the obstacles, by stamp and in the node by silence, beyond which nothing is predicted; 0: never',
        's',
        0.0,
        1e6,
    )
    max_obstacles: int = _p(64, 'obstacles considered; beyond it the ones farthest from the way are left out', '', 1, 4096)
    marker_radius_stddev: float = _p(0.0, 'standard deviation of the radius of obstacles that come as markers', 'm', 0.0, 1.0)


@dataclass(frozen=True)
class Config:
    """All parameters of the predictor."""

    rate_hz: float = _p(50.0, 'predictions per second of message time', 'Hz', 0.1, 1000.0)
    budget_s: float = _p(0.0, 'time of a prediction, beyond which ways are told as out of time; 0: no limit', 's', 0.0, 60.0)
    plane: str = _p('xy', 'task plane of the working frame', choices=PLANES, read_only=True)
    frame_id: str = _p('', 'working frame; empty: the frame of the first hand pose', read_only=True)
    foc: FocConfig = field(default_factory=FocConfig)
    duration: DurationConfig = field(default_factory=DurationConfig)
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    homotopy: HomotopyConfig = field(default_factory=HomotopyConfig)
    likelihood: LikelihoodConfig = field(default_factory=LikelihoodConfig)
    scene: SceneConfig = field(default_factory=SceneConfig)


@dataclass(frozen=True)
class Parameter:
    """One flattened parameter: dotted name, default, bound."""

    name: str
    default: Any
    bound: Bound


def parameters(group: type = Config, prefix: str = '') -> Iterator[Parameter]:
    """Yield every parameter of a config class, depth first, by dotted name."""
    for item in fields(group):
        if 'bound' in item.metadata:
            yield Parameter(prefix + item.name, item.default, item.metadata['bound'])
        else:
            yield from parameters(cast('type', item.default_factory), f'{prefix}{item.name}.')


def flatten(config: Config) -> dict[str, float | int | str]:
    """Return every value by dotted name."""
    values: dict[str, float | int | str] = {}
    for parameter in parameters():
        value: Any = config
        for part in parameter.name.split('.'):
            value = getattr(value, part)
        values[parameter.name] = value
    return values


def updated(config: Config, values: Mapping[str, object]) -> Config:
    """Return the config with some values changed, all checked together.

    values: by dotted name. Raises ParameterError, naming the parameter, the value and the bound; `config` is unharmed.
    """
    known = {parameter.name: parameter for parameter in parameters()}
    for name, value in values.items():
        if name not in known:
            raise ParameterError(name, 'a known parameter', repr(value))
        group, _, leaf = name.rpartition('.')
        checked = _checked(known[name], value)
        config = replace(config, **({group: replace(getattr(config, group), **{leaf: checked})} if group else {leaf: checked}))
    return config


def _checked(parameter: Parameter, value: object) -> float | int | str:
    name, bound = parameter.name, parameter.bound
    if isinstance(parameter.default, str):
        if not isinstance(value, str) or (bound.choices and value not in bound.choices):
            raise ParameterError(name, f'one of {", ".join(bound.choices)}' if bound.choices else 'a text', repr(value))
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ParameterError(name, f'a finite number{_range(bound)}', repr(value))
    if isinstance(parameter.default, int) and value != int(value):
        raise ParameterError(name, f'a whole number{_range(bound)}', repr(value))
    if (bound.low is not None and value < bound.low) or (bound.high is not None and value > bound.high):
        raise ParameterError(name, f'a number{_range(bound)}', repr(value))
    return int(value) if isinstance(parameter.default, int) else float(value)


def _range(bound: Bound) -> str:
    return '' if bound.low is None else f' in [{bound.low:g}, {bound.high:g}] {bound.unit}'.rstrip()
