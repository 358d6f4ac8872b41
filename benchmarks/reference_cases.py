# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Solve ten random reaching problems with independent solvers and write `test/reference_cases.json`.

    pip install numpy quadprog casadi
    python benchmarks/reference_cases.py

The script does not import `foc_ros`. It implements dynamics, constraints and costs again, from the equations of `doc/model.md`.

- `converged_qp`: the reformulated problem at a given (tau, lambda). quadprog solves the full condensed QP, and the obstacle
  constraint is linearised at each solution until the mean converges.
- `min_effort_at_eta`: the least effort subject to the un-linearised surrogate E + k sqrt(Var) <= 0 at every step, by IPOPT with
  exact derivatives from CasADi.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import quadprog
from numpy.typing import NDArray

OUTPUT = Path(__file__).resolve().parents[1] / 'test' / 'reference_cases.json'
CASES = 10
SEED = 20261122
MAX_LINEARISATIONS = 3000
CONVERGED_M = 1e-9

Array = NDArray[np.float64]


def condensed_maps(steps: int, dt: float) -> tuple[Array, Array]:
    """Return the map from one axis' jerk (N,) to its positions at steps 1..N, (N, N), and to its last state, (3, N)."""
    A = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    B = np.array([dt**3 / 6, dt**2 / 2, dt])
    responses = [B]
    for _ in range(steps - 1):
        responses.append(A @ responses[-1])
    positions = np.zeros((steps, steps))
    for step in range(steps):
        for k in range(step + 1):
            positions[step, k] = responses[step - k][0]
    return positions, np.array(responses[::-1]).T


def random_case(generator: np.random.Generator, number: int) -> dict[str, Any]:
    """Return a scene with one to four obstacles near the straight line, and the amplitude of its guess."""
    count = int(generator.integers(1, 5))
    goal = round(float(generator.uniform(0.28, 0.42)), 4)
    obstacles = [
        {
            'x': round(goal * float(generator.uniform(0.3, 0.7)), 4),
            'y': round(float(generator.uniform(-0.07, 0.07)), 4),
            'radius': round(float(generator.uniform(0.017, 0.03)), 4),
            'radius_stddev': round(float(generator.uniform(0.001, 0.0035)), 4),
        }
        for _ in range(count)
    ]
    return {
        'start': [0.0, 0.0],
        'goal': [goal, 0.0],
        'duration_s': [0.8, 1.0, 1.2][number % 3],
        'steps': [40, 50, 60][number % 3],
        'noise': [[0.05, 0.05], [0.1, 0.1]][number % 2],
        'obstacles': obstacles,
        'guess': {'amplitude': round(float(generator.choice([-1, 1]) * generator.uniform(0.05, 0.12)), 4)},
    }


def guess_path(case: dict[str, Any]) -> Array:
    """Return the minimum-jerk straight line plus A sin(pi k / N) in y at steps 1..N, (N, 2)."""
    s = np.arange(1, case['steps'] + 1) / case['steps']
    x = case['goal'][0] * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return np.stack((x, case['guess']['amplitude'] * np.sin(np.pi * s)), axis=1)


def passed_sides(path: Array, case: dict[str, Any]) -> list[int]:
    """Return +1 for each obstacle that a path (N, 2) along x passes on its left, -1 on its right."""
    sides = []
    for obstacle in case['obstacles']:
        nearest = int(np.abs(path[:, 0] - obstacle['x']).argmin())
        sides.append(1 if path[nearest, 1] > obstacle['y'] else -1)
    return sides


def solve_linearised_qp(case: dict[str, Any], path: Array, tau: float, lam: float) -> Array | None:
    """Return the control (2N,) that solves the QP linearised at a path (N, 2), or None where there is none."""
    steps, dt = case['steps'], case['duration_s'] / case['steps']
    positions, last = condensed_maps(steps, dt)
    unit, noise, zero = 1.0 / np.abs(last).max(), np.array(case['noise']), np.zeros((3, steps))
    weights = [2 * (1 + lam * noise[axis] ** 2 * (positions**2).sum(axis=0)) for axis in range(2)]
    equalities = unit * np.block([[last, zero], [zero, last]])
    targets = unit * np.array([case['goal'][0], 0, 0, case['goal'][1], 0, 0])
    rows, limits = [], []
    for obstacle in case['obstacles']:
        centre = np.array([obstacle['x'], obstacle['y']])
        size = obstacle['radius'] ** 2 + obstacle['radius_stddev'] ** 2 + tau
        for step in range(steps):
            offset = path[step] - centre
            scale = 1.0 / (2 * np.hypot(*offset))
            rows.append(2 * scale * np.concatenate((offset[0] * positions[step], offset[1] * positions[step])))
            limits.append(scale * (size - offset @ offset + 2 * offset @ path[step]))
    try:
        control: Array = quadprog.solve_qp(
            np.diag(np.concatenate(weights)),
            np.zeros(2 * steps),
            np.vstack((equalities, np.array(rows) / positions.max())).T,
            np.concatenate((targets, np.array(limits) / positions.max())),
            len(targets),
        )[0]
    except ValueError:
        return None
    return control


def describe_control(case: dict[str, Any], control: Array, tau: float, lam: float) -> dict[str, Any]:
    """Return what is kept of a solution: its effort, the middle of its path, its largest standard deviations, its sides."""
    path = follow_control(case, control)
    positions, _ = condensed_maps(case['steps'], case['duration_s'] / case['steps'])
    variances = [c**2 * positions**2 @ axis**2 for c, axis in zip(case['noise'], control.reshape(2, -1), strict=True)]
    return {
        'tau': tau,
        'lam': lam,
        'effort': float(control @ control),
        'mid': path[case['steps'] // 2 - 1].tolist(),
        'stddev_max': [float(np.sqrt(each.max())) for each in variances],
        'sides': passed_sides(path, case),
    }


def follow_control(case: dict[str, Any], control: Array) -> Array:
    """Return the mean positions (N, 2) of a control (2N,)."""
    positions, _ = condensed_maps(case['steps'], case['duration_s'] / case['steps'])
    return np.stack([positions @ axis for axis in control.reshape(2, -1)], axis=1)


def solve_converged_qp(case: dict[str, Any], tau: float, lam: float) -> dict[str, Any] | None:
    """Return the solution at (tau, lambda), or None where a QP is infeasible or the linearisation does not converge."""
    path = guess_path(case)
    for _ in range(MAX_LINEARISATIONS):
        control = solve_linearised_qp(case, path, tau, lam)
        if control is None:
            return None
        mean = follow_control(case, control)
        move, path = float(np.abs(mean - path).max()), mean
        if move < CONVERGED_M:
            return describe_control(case, control, tau, lam)
    return None


def solve_least_effort(case: dict[str, Any], eta: float) -> dict[str, Any] | None:
    """Return the least effort whose surrogate holds with eta at every step, or None where IPOPT does not converge."""
    steps, dt = case['steps'], case['duration_s'] / case['steps']
    positions, last = condensed_maps(steps, dt)
    # in this unit of jerk the variables are about one
    unit = 60.0 * case['goal'][0] / case['duration_s'] ** 3
    k = float(np.sqrt(eta / (1 - eta)))
    u = casadi.SX.sym('u', 2 * steps)
    axes = (u[:steps], u[steps:])
    x, y = (casadi.DM(positions * unit) @ axis for axis in axes)
    var_x, var_y = (
        noise**2 * casadi.DM((positions * unit) ** 2) @ axis**2 for noise, axis in zip(case['noise'], axes, strict=True)
    )
    ends = casadi.vertcat(*(casadi.DM(last * unit / np.array([[0.1], [1.0], [10.0]])) @ axis for axis in axes))
    targets = [case['goal'][0] / 0.1, 0, 0, case['goal'][1] / 0.1, 0, 0]
    clear = []
    for obstacle in case['obstacles']:
        dx, dy = x - obstacle['x'], y - obstacle['y']
        mean, var = obstacle['radius'] ** 2, obstacle['radius_stddev'] ** 2
        spread = 4 * mean * var + 2 * var**2 + 4 * dx**2 * var_x + 4 * dy**2 * var_y
        clear.append((dx**2 + dy**2 - mean - var - k * casadi.sqrt(spread + 1e-18)) / mean)
    rows = casadi.vertcat(*clear)
    program = {'x': u, 'f': casadi.dot(u, u) / steps, 'g': casadi.vertcat(ends, rows)}
    options: Any = {'print_time': False, 'ipopt.print_level': 0, 'ipopt.sb': 'yes', 'ipopt.tol': 1e-10, 'ipopt.max_iter': 3000}
    solver = casadi.nlpsol('reference', 'ipopt', program, options)
    path = guess_path(case)
    start = np.concatenate([np.linalg.lstsq(positions, axis, rcond=1e-6)[0] for axis in path.T]) / unit
    answer = solver(
        x0=start,
        lbg=np.concatenate((targets, np.zeros(rows.numel()))),
        ubg=np.concatenate((targets, np.full(rows.numel(), np.inf))),
    )
    if not solver.stats()['success']:
        return None
    control = unit * np.asarray(answer['x']).ravel()
    return {'eta': eta, 'ipopt_effort': float(control @ control), 'sides': passed_sides(follow_control(case, control), case)}


def main() -> None:
    """Draw scenes until both solvers have solved ten of them and pass the obstacles on the same sides."""
    generator, cases = np.random.default_rng(SEED), list[dict[str, Any]]()
    settings = [(0.0, 1.0), (0.0, 1e4), (2e-4, 1e5), (5e-4, 1e6)]
    while len(cases) < CASES:
        case = random_case(generator, len(cases))
        tau, lam = settings[len(cases) % len(settings)]
        converged, least = solve_converged_qp(case, tau, lam), solve_least_effort(case, [0.8, 0.9, 0.95][len(cases) % 3])
        if converged is None or least is None or converged['sides'] != least['sides']:
            continue
        cases.append(case | {'converged_qp': converged, 'min_effort_at_eta': least})
        print(f'{len(cases)}: {len(case["obstacles"])} obstacles, effort {least["ipopt_effort"]:.1f} at eta {least["eta"]}')
    OUTPUT.write_text(json.dumps(cases, indent=1) + '\n', encoding='utf-8')


if __name__ == '__main__':
    main()
