"""The reference cases, compared with the solvers of `scripts/make_reference_cases.py` and `scripts/make_reference_shapes.py`."""

from __future__ import annotations

from .page import format_table
from .scenes import load_reference_cases, load_reference_shapes, solve


def format_agreement() -> str:
    """Return the table of relative differences of effort."""
    head = ['case', 'obstacles', 'c', 'η', '`fixed` / quadprog − 1', '`optimal` / IPOPT − 1', 'η achieved']
    rows = []
    for number, (case, problem, guess) in enumerate(load_reference_cases()):
        qp, least = case['converged_qp'], case['min_effort_at_eta']
        fixed = solve(problem, guess, 'fixed', tau=qp['tau'], lam=qp['lam'])
        optimal = solve(problem, guess, 'optimal')
        rows.append(
            [
                str(number),
                str(len(problem.obstacles)),
                f'{problem.noise[0]:g}',
                f'{least["eta"]:g}',
                f'{fixed.effort / qp["effort"] - 1:.0e}',
                f'{optimal.effort / least["ipopt_effort"] - 1:.1e}',
                f'{optimal.eta:.5f}',
            ]
        )
    return format_table(head, rows)


def format_shapes() -> str:
    """Return the table of relative differences of cost and effort in scenes of boxes, capsules, hulls and circles."""
    head = ['case', 'obstacles', 'η', '`fixed` / IPOPT − 1', '`optimal` / IPOPT − 1', 'η achieved']
    rows = []
    for number, (case, problem, guess) in enumerate(load_reference_shapes()):
        reference, least = case['fixed'], case['min_effort_at_eta']
        fixed = solve(problem, guess, 'fixed', tau=reference['tau'], lam=reference['lam'])
        optimal = solve(problem, guess, 'optimal')
        rows.append(
            [
                str(number),
                ', '.join(each['kind'] for each in case['obstacles']),
                f'{least["eta"]:g}',
                f'{(fixed.costs["effort"] + fixed.costs["lambda_variance"]) / reference["cost"] - 1:.0e}',
                f'{optimal.effort / least["ipopt_effort"] - 1:.1e}',
                f'{optimal.eta:.5f}',
            ]
        )
    return format_table(head, rows)
