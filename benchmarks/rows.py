# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The rows of the benchmark: `ROWS` maps the name of each to a function of whether to be quick, which returns a `Result`.

CasADi is imported only when a row is measured that compares with its solvers.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import scenes

from foc_ros import replay
from foc_ros.core import predict as predictor
from foc_ros.core.candidates import solve_candidates
from foc_ros.core.config import Config, FocConfig
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start, resample, warm_start
from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import Solution, Status
from foc_ros.core.tracks import NO_TRACKS, Tracks
from foc_ros.core.types import NANOSECONDS

Array = scenes.Array
SETTINGS = FocConfig(strategy='optimal')
TICK_S = 1.0 / scenes.RATE_HZ
TOLERANCE, SHARP_TOLERANCE = 0.02, 0.05
"""Largest relative difference of efforts: a peer keeps clear at the steps only, and may cut a sharp corner between them."""


@dataclass(frozen=True)
class Result:
    """Measurement of one row.

    ours, peer: what was timed, in words; ours_ms, peer_ms: the medians of its times [ms]; agree: whether the answers differ by no
    more than the tolerance; agreement: the difference in words; details: further numbers by name.
    """

    ours: str
    ours_ms: float
    peer: str
    peer_ms: float
    agree: bool
    agreement: str
    repetitions: int
    details: dict[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the result as a JSON object; ratio: how many times as long the peer takes."""
        return {**vars(self), 'ratio': self.peer_ms / self.ours_ms}


def time_call(task: Callable[[], object]) -> float:
    """Return the time of a call [s]."""
    began = time.perf_counter()
    task()
    return time.perf_counter() - began


def time_in_turn(tasks: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, list[float]]:
    """Run all tasks once untimed, then one after the other `repetitions` times, and return the times.

    Because the tasks take turns, any other load of the machine slows all of them alike.
    """
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for task in tasks.values():
        task()
    for _ in range(repetitions):
        for name, task in tasks.items():
            times[name].append(time_call(task))
    return times


def compute_median_ms(times: list[float]) -> float:
    """Return the median of times [s] in milliseconds."""
    return 1e3 * statistics.median(times)


def measure_cold(build: Callable[[], Obstacles], name: str, is_quick: bool) -> Result:
    """Compare one class, from a guess, with a peer. Our program builds the problem in every call, the peer beforehand."""
    from peers import build_fastest, fit_guess

    guess, problem = scenes.build_guess(), scenes.build_problem(build())
    peer = build_fastest(name, problem, fit_guess(problem, guess))
    arguments = peer.prepare(problem, fit_guess(problem, guess))

    def solve() -> Solution:
        return solve_problem(scenes.build_problem(build()), cold_start(guess), SETTINGS)

    repetitions = 3 if is_quick else 25
    times = time_in_turn({'ours': solve, 'peer': lambda: peer.solve(arguments)}, repetitions)
    ours, control = solve(), peer.read_control(problem, peer.solve(arguments))
    return Result(
        'one class, from a guess',
        compute_median_ms(times['ours']),
        f'{name}, from the least effort through the middle of the guess, built beforehand',
        compute_median_ms(times['peer']),
        *_compare([ours], [control if peer.converged else None]),
        repetitions,
        {'qps_ours': ours.qp_solves, 'iterations_peer': peer.iterations},
    )


def measure_warm(build: Callable[[], Obstacles], name: str, is_quick: bool) -> Result:
    """Compare the ticks of a hand that follows its plan with noise, each from its own solution of the tick before."""
    from peers import build_fastest, fit_guess

    ticks, generator, obstacles = (4 if is_quick else 25), np.random.default_rng(0), build()
    problem = scenes.build_problem(obstacles)
    ours = solve_problem(problem, cold_start(scenes.build_guess()), SETTINGS)
    peer = build_fastest(name, problem, fit_guess(problem, scenes.build_guess()))
    control = peer.read_control(problem, peer.solve(peer.prepare(problem, fit_guess(problem, scenes.build_guess()))))
    found, theirs, times, peer_times = [], [], [], []
    for tick in range(ticks):
        mean, left_s = _follow_plan(ours, generator), scenes.DURATION_S - (tick + 1) * TICK_S
        problem = scenes.build_problem(obstacles, mean, left_s)
        begin, stride = np.array([TICK_S / ours.dt]), np.array([problem.horizon.dt / ours.dt])
        shifted = resample(ours.path[None], control[None], begin, stride, scenes.STEPS)[1][0]
        arguments = peer.prepare(problem, shifted.reshape(2, -1).T)
        began = time.perf_counter()
        problem = scenes.build_problem(obstacles, mean, left_s)
        ours = solve_problem(problem, warm_start([ours], [problem])[0], SETTINGS)
        times.append(time.perf_counter() - began)
        began = time.perf_counter()
        variables = peer.solve(arguments)
        peer_times.append(time.perf_counter() - began)
        control = peer.read_control(problem, variables)
        found.append(ours)
        theirs.append(control if peer.converged else None)
    return Result(
        'one class, from the solution of 10 ms ago',
        compute_median_ms(times),
        f'{name}, from its solution of 10 ms ago, built beforehand',
        compute_median_ms(peer_times),
        *_compare(found, theirs),
        ticks,
        {'slowest_ms': 1e3 * max(times), 'slowest_peer_ms': 1e3 * max(peer_times)},
    )


def _follow_plan(solution: Solution, generator: np.random.Generator) -> Array:
    """Return the state that a plan has after a tick, with noise in its position."""
    u, t = solution.control[0], TICK_S
    x, v, a = solution.mean[0].reshape(3, 2)
    state = np.concatenate((x + t * v + t**2 / 2 * a + t**3 / 6 * u, v + t * a + t**2 / 2 * u, a + t * u))
    state[:2] += generator.normal(0.0, scenes.TRACKER_STDDEV, 2)
    return state


def _compare(ours: Sequence[Solution], theirs: Sequence[Array | None], tolerance: float = TOLERANCE) -> tuple[bool, str]:
    """Return whether efforts agree with those of controls, None where a peer did not converge, and the difference in words."""
    pairs = zip(ours, theirs, strict=True)
    excess = [mine.effort / float((control**2).sum()) - 1 for mine, control in pairs if control is not None]
    solved = sum(each.status is Status.SOLVED for each in ours)
    converged = sum(each is not None for each in theirs)
    worst = max(excess, key=abs, default=np.inf)
    return (
        solved == converged == len(ours) and abs(worst) < tolerance,
        f'solved {solved} of {len(ours)}, the peer {converged}; '
        f'efforts differ by up to {100 * worst:+.3f} % ({100 * tolerance:g} % allowed)',
    )


class TickSequence:
    """The ticks of a reach, repeated without end, as the node makes them."""

    def __init__(self, reach: scenes.Reach) -> None:
        self.reach, self.index, self.memory = reach, 0, NO_TRACKS
        self.predictions: list[Prediction] = []

    def tick(self) -> None:
        """Make the next prediction that does not begin a movement."""
        self.index %= len(self.reach.hands)
        if self.index == 0:
            self.memory = self.predict(NO_TRACKS)[1]
            self.index = 1
        prediction, self.memory = self.predict(self.memory)
        self.index += 1
        self.predictions.append(prediction)

    def predict(self, memory: Tracks) -> tuple[Prediction, Tracks]:
        """Make the prediction of the present tick."""
        reach = self.reach
        return predictor.predict(reach.config, reach.hands[self.index], reach.obstacles, reach.goals, memory)

    def find_problem(self, label: str) -> Problem:
        """Return the problem of a candidate of the present tick."""
        with patch.object(predictor, 'solve_candidates', wraps=solve_candidates) as solving:
            self.predict(self.memory)
        calls = (zip(*call.args[:2], strict=True) for call in solving.call_args_list)
        problems: dict[str, Problem] = {each.label: problem for call in calls for each, problem in call}
        return problems[label]

    def describe(self) -> str:
        """Return how many candidates were solved, and of how many; the median over the ticks."""
        counts = sorted((len(each.solved_candidates), len(each.candidates)) for each in self.predictions)
        return '{} of {}'.format(*counts[len(counts) // 2])


def measure_tick(build: Callable[[], scenes.Reach], scene: str, tolerance: float, is_quick: bool) -> Result:
    """Compare whole warm ticks with IPOPT, which solves only the problem of the most likely class."""
    from peers import build_fastest

    sequence, repetitions = TickSequence(build()), 3 if is_quick else 25
    cold = time_call(lambda: sequence.predict(NO_TRACKS))
    sequence.tick()
    best = sequence.predictions[-1].solved_candidates[0]
    problem = sequence.find_problem(best.label)
    peer = build_fastest('IPOPT', problem, best.solution.control)
    arguments = peer.prepare(problem, best.solution.control)
    times = time_in_turn({'ours': sequence.tick, 'peer': lambda: peer.solve(arguments)}, repetitions)
    control = peer.read_control(problem, peer.solve(arguments))
    return Result(
        f'a warm tick, {scene}',
        compute_median_ms(times['ours']),
        'IPOPT, its most likely class alone, from our solution of 10 ms ago',
        compute_median_ms(times['peer']),
        *_compare([best.solution], [control if peer.converged else None], tolerance),
        repetitions,
        {'solved': sequence.describe(), 'slowest_ms': 1e3 * max(times['ours']), 'first_tick_ms': 1e3 * cold},
    )


def measure_change(values: Mapping[str, object], far: int, change: str, is_quick: bool) -> Result:
    """Compare a warm tick of four classes with one of more obstacles or of other parameters."""
    base = scenes.build_4x8()
    other = replace(scenes.add_far_obstacles(base, far), config=base.config.with_values(dict(values)))
    sequences = {'ours': TickSequence(base), 'peer': TickSequence(other)}
    repetitions = 3 if is_quick else 40
    times = time_in_turn({name: each.tick for name, each in sequences.items()}, repetitions)
    likelihoods = [{c.label: c.likelihood for c in each.predictions[-1].candidates} for each in sequences.values()]
    differences = [abs(likelihoods[0].get(name, 0.0) - likelihoods[1].get(name, 0.0)) for name in set().union(*likelihoods)]
    return Result(
        'a warm tick, 4 classes, 8 circles, N = 50',
        compute_median_ms(times['ours']),
        f'the same {change}',
        compute_median_ms(times['peer']),
        max(differences) < 0.02,
        f'likelihoods differ by up to {max(differences):.1e} (0.02 allowed)',
        repetitions,
        {'solved': sequences['peer'].describe()},
    )


def measure_replay(is_quick: bool) -> Result:
    """Compare the replay of the packaged recording at default parameters with the time that it took to record."""
    recording = Path(str(files('foc_ros'))) / 'recordings' / 'reaching.mcap'
    answers: list[list[Prediction]] = []
    times = [time_call(lambda: answers.append(list(replay(recording, Config())))) for _ in range(1 if is_quick else 3)]
    stamps = [each.stamp_ns for each in answers[0]]
    first, last = ([[c.likelihood for c in each.candidates] for each in answer] for answer in (answers[0], answers[-1]))
    return Result(
        f'replay of the packaged recording, {len(stamps)} predictions',
        compute_median_ms(times),
        'the time it took to record',
        (stamps[-1] - stamps[0]) / NANOSECONDS * 1e3,
        first == last,
        'the first and the last replay are the same to the last bit',
        len(times),
        {'ms_per_prediction': compute_median_ms(times) / len(stamps)},
    )


SCENES = {'circles': scenes.build_circles, 'boxes': scenes.build_boxes}
ROWS: dict[str, Callable[[bool], Result]] = {
    f'{measure.__name__.removeprefix("measure_")}_{kind}_{name.lower()}': partial(measure, build, name)
    for kind, build in SCENES.items()
    for measure in (measure_cold, measure_warm)
    for name in ('Fatrop', 'IPOPT')
} | {
    'tick_circles': partial(measure_tick, scenes.build_4x8, '4 classes, 8 circles', TOLERANCE),
    'tick_boxes': partial(measure_tick, scenes.build_4_boxes, '6 candidates, 2 goals, 4 sharp boxes', SHARP_TOLERANCE),
    'far_obstacles': partial(measure_change, {}, 248, 'with 248 circles more, 1 to 3 m away'),
    'steps_200': partial(measure_change, {'foc.steps': 200}, 0, 'with N = 200'),
    'replay': measure_replay,
}
