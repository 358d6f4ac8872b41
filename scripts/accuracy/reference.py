"""The ten reference cases, beside independent solvers."""

from __future__ import annotations

from .page import table
from .scenes import reference_cases, solved


def text() -> str | None:
    """Return the table of agreement; None where the reference cases are absent."""
    cases = reference_cases()
    if not cases:
        return None
    head = [
        'case',
        'obstacles',
        'c',
        'η',
        '`fixed` / quadprog − 1',
        '`optimal` / cone solver − 1',
        '`optimal` / IPOPT − 1',
        'η achieved',
    ]
    rows = []
    for number, (case, problem, guess) in enumerate(cases):
        single, best = case['converged_qp'], case['min_effort_at_eta']
        fixed = solved(problem, guess, 'fixed', tau=single['tau'], lam=single['lam'])
        optimal = solved(problem, guess, 'optimal')
        rows.append(
            [
                str(number),
                str(len(problem.obstacles)),
                f'{problem.noise[0]:g}',
                f'{best["eta"]:g}',
                f'{fixed.effort / single["effort"] - 1:.0e}',
                f'{optimal.effort / best["socp_ccp_effort"] - 1:.1e}',
                f'{optimal.effort / best["ipopt_effort"] - 1:.1e}',
                f'{optimal.eta:.5f}',
            ]
        )
    return table(head, rows)
