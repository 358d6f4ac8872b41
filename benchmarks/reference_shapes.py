# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Solve ten random reaching problems among boxes, capsules, hulls and circles with IPOPT, and write `test/reference_shapes.json`.

    pip install numpy quadprog casadi
    python benchmarks/reference_shapes.py

The script does not import `foc_ros`. The point q = sum_i w_i v_i of a polygon that is nearest to a position p is not computed by
a rule: its weights are variables of the programme, with sum_i w_i = 1 and w >= 0, and q is the nearest point if and only if
(p - q).(v_i - q) <= 0 for every vertex v_i. IPOPT begins at several paths of the class, and the least effort counts.

- `fixed`: the least J_aug at a given (tau, lambda), subject to |p - q|^2 >= E[R^2] + tau at every step.
- `min_effort_at_eta`: the least effort subject to E + k sqrt(Var) <= 0 at `GRID` times in every step, from the first step on.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from reference_cases import Array, guess_path

OUTPUT = Path(__file__).resolve().parents[1] / 'test' / 'reference_shapes.json'
SEED = 20261123
GRID = 4
NEAR_M = 0.05
"""Distance of a start from a polygon within which its constraint is part of the programme from the beginning."""
SIZE_M = 0.03
"""Unit of length of the constraints."""
SLACKS_M2 = (1e-5, 1e-7, 1e-9)
"""What (p - q).(v_i - q) may exceed zero by: the programme with zero itself has no interior."""
TOLERANCE_M = 2e-6
OPTIONS: Any = {
    'print_time': False,
    'show_eval_warnings': False,
    'ipopt.print_level': 0,
    'ipopt.sb': 'yes',
    'ipopt.tol': 1e-9,
    'ipopt.max_iter': 250,
    'ipopt.bound_relax_factor': 0.0,
    'ipopt.mu_strategy': 'adaptive',
}
AMPLITUDES = (1.0, 0.7, 1.4)
KINDS = (
    ('box', 'circle'),
    ('sharp box', 'capsule'),
    ('hull', 'box'),
    ('rotated box', 'circle', 'circle'),
    ('moving box', 'circle'),
    ('uncertain box', 'capsule'),
    ('sharp box', 'rotated box', 'circle'),
    ('capsule', 'hull'),
    ('hull', 'sharp box'),
    ('rotated box', 'hull', 'box'),
)


def random_obstacle(generator: np.random.Generator, kind: str, goal: float) -> dict[str, Any]:
    """Return an obstacle near the straight line, as a user gives it."""
    centre = np.array([goal * generator.uniform(0.32, 0.68), generator.uniform(-0.06, 0.06)])
    made: dict[str, Any] = {'kind': kind.split()[-1], 'radius': generator.uniform(0.008, 0.02)}
    made['radius_stddev'] = generator.uniform(0.001, 0.003)
    if made['kind'] == 'box':
        made |= {'centre': centre, 'size': generator.uniform(0.02, 0.06, 2), 'yaw': 0.0}
    if made['kind'] == 'capsule':
        half = generator.uniform(0.01, 0.035) * direction(generator.uniform(-np.pi, np.pi))
        made |= {'start': centre - half, 'end': centre + half}
    if made['kind'] == 'hull':
        angles = np.arange(3 + generator.integers(3)) * 2.4 + generator.uniform(-0.4, 0.4)
        made |= {'points': [centre + generator.uniform(0.015, 0.04) * direction(angle) for angle in angles]}
    if made['kind'] == 'circle':
        made |= {'centre': centre, 'radius': generator.uniform(0.015, 0.028)}
    if kind in ('rotated box', 'moving box'):
        made['yaw'] = generator.uniform(-1.4, 1.4)
    if kind == 'sharp box':
        made |= {'yaw': generator.uniform(-1.4, 1.4), 'radius': 0.0, 'radius_stddev': 0.0}
    if kind == 'moving box':
        made['velocity'] = generator.uniform(-0.05, 0.05, 2)
    if kind == 'uncertain box':
        made['centre_stddev'] = 0.003
    return {key: value if isinstance(value, str) else np.round(value, 4).tolist() for key, value in made.items()}


def direction(angle: float) -> Array:
    """Return the unit vector at an angle [rad]."""
    return np.array([np.cos(angle), np.sin(angle)])


def random_case(generator: np.random.Generator, number: int) -> dict[str, Any]:
    """Return a scene with the kinds of obstacles of its number, and the amplitude of its guess."""
    goal = round(float(generator.uniform(0.3, 0.42)), 4)
    return {
        'start': [0.0, 0.0],
        'goal': [goal, 0.0],
        'duration_s': [0.8, 1.0, 1.2][number % 3],
        'steps': [40, 50, 60][number % 3],
        'noise': [[0.05, 0.05], [0.1, 0.1], [0.06, 0.12]][number % 3],
        'obstacles': [random_obstacle(generator, kind, goal) for kind in KINDS[number]],
        'guess': {'amplitude': round(float(generator.choice([-1, 1]) * generator.uniform(0.05, 0.14)), 4)},
    }


def find_vertices(obstacle: dict[str, Any]) -> Array:
    """Return the points (v, 2) [m] whose convex hull the obstacle surrounds, at time 0."""
    if obstacle['kind'] == 'circle':
        return np.array([obstacle['centre']])
    if obstacle['kind'] == 'capsule':
        return np.array([obstacle['start'], obstacle['end']])
    if obstacle['kind'] == 'hull':
        return np.array(obstacle['points'])
    along, across = direction(obstacle['yaw']), direction(obstacle['yaw'] + np.pi / 2)
    length, width = obstacle['size']
    signs = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return np.array([obstacle['centre'] + a * length / 2 * along + b * width / 2 * across for a, b in signs])


def find_weights(vertices: Array, point: Array) -> tuple[Array, float]:
    """Return the weights (v,) of the nearest point of a hull, and the distance to it [m], 0 inside.

    Every pair of vertices is tried; the nearest point of the hull is on the nearest of these lines, unless the point is inside.
    """
    v = len(vertices)
    best, weights = np.inf, np.zeros(v)
    for a in range(v):
        for b in range(a, v):
            along = vertices[b] - vertices[a]
            share = 0.0 if a == b else float(np.clip((point - vertices[a]) @ along / (along @ along), 0.0, 1.0))
            distance = float(np.hypot(*(point - vertices[a] - share * along)))
            if distance < best - 1e-12:
                best, weights = distance, (1.0 - share) * np.eye(v)[a] + share * np.eye(v)[b]
    offset = point - weights @ vertices
    is_outside = bool(((vertices - weights @ vertices) @ offset <= 1e-9).all())
    return weights, best if is_outside else 0.0


def effects_at(case: dict[str, Any], times: Array) -> Array:
    """Return the effect (q, N) of a jerk that is constant in each step on the position at times (q,), in steps."""
    dt = case['duration_s'] / case['steps']
    elapsed = np.maximum(times[:, None] - np.arange(case['steps']), 0.0) * dt
    effects: Array = (elapsed**3 - np.maximum(elapsed - dt, 0.0) ** 3) / 6.0
    return effects


def ends_at(case: dict[str, Any]) -> Array:
    """Return the effect (3, N) of the jerk of one axis on its last position, velocity and acceleration."""
    dt = case['duration_s'] / case['steps']
    before = (case['steps'] - np.arange(case['steps'])) * dt
    after = before - dt
    return np.array([(before**3 - after**3) / 6.0, (before**2 - after**2) / 2.0, before - after])


def centre_moved(case: dict[str, Any], obstacle: dict[str, Any], time: float) -> Array:
    """Return how far an obstacle has moved at a time in steps, (2,) [m]."""
    moved: Array = np.array(obstacle.get('velocity', [0.0, 0.0])) * time * case['duration_s'] / case['steps']
    return moved


def required(obstacle: dict[str, Any]) -> tuple[float, float]:
    """Return E[R^2] and Var[R^2]."""
    mean2, var = obstacle['radius'] ** 2, obstacle['radius_stddev'] ** 2
    return mean2 + var, 4 * mean2 * var + 2 * var**2


class Collected:
    """Variables and rows of a programme."""

    def __init__(self) -> None:
        self.variables, self.rows = list[Any](), list[Any]()
        self.start, self.lowest, self.low, self.high = list[float](), list[float](), list[float](), list[float]()

    def add_variables(self, name: str, start: Array, lowest: float = -np.inf) -> Any:
        """Add variables that begin at a start (q,)."""
        made = casadi.SX.sym(name, len(start))
        self.variables.append(made)
        self.start += list(start)
        self.lowest += [lowest] * len(start)
        return made

    def add_rows(self, rows: Any, low: list[float], high: list[float]) -> None:
        """Add rows with their bounds."""
        self.rows.append(rows)
        self.low += low
        self.high += high


def add_nearest(made: Collected, vertices: Array, place: Any, start: Array, slack: float) -> Any:
    """Add the nearest point of a hull as variables and rows, and return it."""
    if len(vertices) == 1:
        return casadi.DM(vertices[0])
    weights = made.add_variables('w', find_weights(vertices, start)[0], 0.0)
    nearest = casadi.DM(vertices.T) @ weights
    made.add_rows(casadi.sum1(weights), [1.0], [1.0])
    angles = [casadi.dot(place - nearest, casadi.DM(vertex) - nearest) - slack for vertex in vertices]
    made.add_rows(casadi.vertcat(*angles) / SIZE_M**2, [-np.inf] * len(vertices), [0.0] * len(vertices))
    return nearest


class Programme:
    """The programme of a case: margins at rows (time in steps, number of the obstacle), for k, or for tau and lambda.

    With k the effort alone counts; without it J_aug, and a distance is to be kept.
    """

    def __init__(self, case: dict[str, Any], k: float | None, tau: float = 0.0, lam: float = 0.0) -> None:
        self.case, self.k, self.tau = case, k, tau
        # in this unit of jerk the variables are about one
        self.unit = 60.0 * case['goal'][0] / case['duration_s'] ** 3
        steps = case['steps']
        self.times = np.arange(1.0, steps + 1e-9, 1.0 if k is None else 1.0 / GRID)
        self.effects = effects_at(case, self.times)
        at_steps = (effects_at(case, np.arange(1.0, steps + 1)) ** 2).sum(axis=0)
        self.weight = np.concatenate([1.0 + lam * noise**2 * at_steps for noise in case['noise']])

    def follow(self, control: Array) -> Array:
        """Return positions (q, 2) at the times of the programme."""
        return np.stack([self.effects @ axis for axis in control.reshape(2, -1)], axis=1)

    def measure(self, control: Array) -> tuple[Array, Array]:
        """Return distances from the polygons and margins (q, obstacles) [m], computed at the nearest points themselves."""
        path = self.follow(control)
        variances = np.stack(
            [self.effects**2 @ (c * axis) ** 2 for c, axis in zip(self.case['noise'], control.reshape(2, -1), strict=True)], 1
        )
        distances, margins = np.empty((2, len(path), len(self.case['obstacles'])))
        for j, obstacle in enumerate(self.case['obstacles']):
            vertices, (mean, size) = find_vertices(obstacle), required(obstacle)
            for i, time in enumerate(self.times):
                point = path[i] - centre_moved(self.case, obstacle, time)
                weights, distance = find_weights(vertices, point)
                square = (point - weights @ vertices) ** 2
                spread = size + 4.0 * square @ (variances[i] + obstacle.get('centre_stddev', 0.0) ** 2)
                kept = mean + self.tau if self.k is None else mean + self.k * np.sqrt(spread)
                distances[i, j], margins[i, j] = distance, (distance**2 - kept) / (2 * max(distance, 0.005))
        return distances, margins

    def solve(self, control: Array) -> Array | None:
        """Return the control of a local minimum near one, or None where IPOPT does not converge."""
        rows = np.argwhere(self.measure(control)[0] < NEAR_M)
        for _ in range(4):
            found: Array | None = control
            for slack in SLACKS_M2:
                found = None if found is None else self.solve_rows(found, rows, slack)
            if found is None:
                return None
            more = np.argwhere(self.measure(found)[1] < -TOLERANCE_M)
            known = set(map(tuple, rows.tolist()))
            more = np.array([row for row in more.tolist() if tuple(row) not in known], dtype=int).reshape(-1, 2)
            if not len(more):
                return found
            rows, control = np.concatenate((rows, more)), found
        return None

    def solve_rows(self, control: Array, rows: NDArray[np.intp], slack: float) -> Array | None:
        """Solve with margins at some rows, from a control."""
        case, steps = self.case, self.case['steps']
        made = Collected()
        u = made.add_variables('u', control / self.unit)
        axes = (u[:steps], u[steps:])
        ends = casadi.DM(ends_at(case) * self.unit / np.array([[0.1], [1.0], [10.0]]))
        for axis, goal in zip(axes, case['goal'], strict=True):
            made.add_rows(ends @ axis, [goal / 0.1, 0.0, 0.0], [goal / 0.1, 0.0, 0.0])
        path = self.follow(control)
        for i in np.unique(rows[:, 0]):
            place, variances = self.add_time(made, axes, control, i)
            for j in rows[rows[:, 0] == i, 1]:
                obstacle = case['obstacles'][j]
                vertices = find_vertices(obstacle) + centre_moved(case, obstacle, self.times[i])
                self.add_margin(made, obstacle, place - add_nearest(made, vertices, place, path[i], slack), variances)
        weight = casadi.DM(self.weight / self.weight.sum())
        program = {'x': casadi.vertcat(*made.variables), 'f': casadi.dot(weight * u, u), 'g': casadi.vertcat(*made.rows)}
        solver = casadi.nlpsol('reference', 'ipopt', program, OPTIONS)
        answer = solver(x0=made.start, lbx=made.lowest, lbg=made.low, ubg=made.high)
        if solver.stats()['return_status'] not in ('Solve_Succeeded', 'Solved_To_Acceptable_Level'):
            return None
        found: Array = self.unit * np.asarray(answer['x']).ravel()[: 2 * steps]
        return found

    def add_time(self, made: Collected, axes: tuple[Any, Any], control: Array, i: int) -> tuple[Any, Any]:
        """Add the position and the variances at a time as variables, so that the Hessian is sparse; return them."""
        effect = self.effects[i]
        path, jerks = effect @ control.reshape(2, -1).T, control.reshape(2, -1) * np.array(self.case['noise'])[:, None]
        place = made.add_variables(f'p_{i}', path / SIZE_M)
        made.add_rows(place - casadi.vertcat(*(casadi.DM(effect * self.unit / SIZE_M).T @ axis for axis in axes)), [0, 0], [0, 0])
        unit = (0.1 * SIZE_M) ** 2
        variances = made.add_variables(f'v_{i}', effect**2 @ jerks.T**2 / unit, 0.0)
        grown = [
            c**2 * casadi.DM((effect * self.unit) ** 2 / unit).T @ axis**2
            for c, axis in zip(self.case['noise'], axes, strict=True)
        ]
        made.add_rows(variances - casadi.vertcat(*grown), [0, 0], [0, 0])
        return place * SIZE_M, variances * unit

    def add_margin(self, made: Collected, obstacle: dict[str, Any], offset: Any, variances: Any) -> None:
        """Add the margin at an offset (2,) from a polygon."""
        square, (mean, size) = casadi.sumsqr(offset), required(obstacle)
        kept = mean + self.tau
        if self.k is not None:
            spread = size + 4 * casadi.dot(offset**2, variances + obstacle.get('centre_stddev', 0.0) ** 2)
            kept = mean + self.k * casadi.sqrt(spread + 1e-18)
        # the second row: where E[R^2] is zero, a position inside the polygon would do
        made.add_rows(casadi.vertcat(square - kept, square) / SIZE_M**2, [0.0, 1e-3], [np.inf, np.inf])


def find_sides(case: dict[str, Any], path: Array, times: Array) -> list[int]:
    """Return +1 for each obstacle that a path (q, 2) sweeps about clockwise, which is on its right, else -1."""
    sides = []
    for obstacle in case['obstacles']:
        middle = find_vertices(obstacle).mean(axis=0)
        relative = path - middle - np.array([centre_moved(case, obstacle, time) for time in times])
        angles = np.unwrap(np.arctan2(relative[:, 1], relative[:, 0]))
        sides.append(1 if angles[-1] < angles[0] else -1)
    return sides


def start_control(case: dict[str, Any], share: float) -> Array:
    """Return the control whose positions at the steps are those of the guess, with a share of its amplitude."""
    path = guess_path(case | {'guess': {'amplitude': share * case['guess']['amplitude']}})
    effects = effects_at(case, np.arange(1.0, case['steps'] + 1))
    return np.concatenate([np.linalg.lstsq(effects, axis, rcond=1e-6)[0] for axis in path.T])


def solve_from_starts(case: dict[str, Any], programme: Programme, starts: list[Array]) -> Array | None:
    """Return the best control of the class of the guess."""
    wanted = find_sides(case, programme.follow(start_control(case, 1.0)), programme.times)
    best, least = None, np.inf
    for start in starts:
        found = programme.solve(start)
        if found is None:
            continue
        cost = float(programme.weight @ found**2)
        deepest = programme.measure(found)[1].min()
        print(f'    cost {cost:.6g}, margin {deepest:.1e}, sides {find_sides(case, programme.follow(found), programme.times)}')
        if find_sides(case, programme.follow(found), programme.times) == wanted and cost < least and deepest > -2e-5:
            best, least = found, cost
    return best


def solve_case(case: dict[str, Any], number: int) -> dict[str, Any] | None:
    """Return a case with the answers of both programmes, or None where IPOPT does not find them."""
    tau, lam = [(2e-4, 1.0), (2e-4, 1e4), (3e-4, 1e5), (5e-4, 1e6)][number % 4]
    eta = [0.8, 0.9, 0.95][number % 3]
    first = Programme(case, float(np.sqrt(eta / (1 - eta))))
    if first.measure(start_control(case, 1.0))[0].min() < 0.012:
        return None
    starts = [start_control(case, share) for share in AMPLITUDES]
    least = solve_from_starts(case, first, starts)
    if least is None:
        return None
    second = Programme(case, None, tau, lam)
    fixed = solve_from_starts(case, second, starts)
    if fixed is None:
        return None
    sides, deepest = find_sides(case, second.follow(fixed), second.times), first.measure(least)[1].min()
    return case | {
        'fixed': {
            'tau': tau,
            'lam': lam,
            'cost': float(second.weight @ fixed**2),
            'effort': float(fixed @ fixed),
            'mid': second.follow(fixed)[case['steps'] // 2 - 1].tolist(),
            'sides': sides,
        },
        'min_effort_at_eta': {
            'eta': eta,
            'ipopt_effort': float(least @ least),
            'sides': find_sides(case, first.follow(least), first.times),
            'least_margin_m': float(deepest),
        },
    }


def main() -> None:
    """Draw scenes of each number until IPOPT has solved one."""
    cases = []
    for number in range(len(KINDS)):
        generator, solved = np.random.default_rng((SEED, number)), None
        while solved is None:
            solved = solve_case(random_case(generator, number), number)
        cases.append(solved)
        least = solved['min_effort_at_eta']
        print(f'{number}: {KINDS[number]}, effort {least["ipopt_effort"]:.1f} at eta {least["eta"]}', flush=True)
    OUTPUT.write_text(json.dumps(cases, indent=1) + '\n', encoding='utf-8')


if __name__ == '__main__':
    main()
