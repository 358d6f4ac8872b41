"""What the buttons after a session start: commands of foc_ros in processes of their own, of low priority."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from foc_ros.analysis.fitting.comparison import find_worse_positions
from foc_ros.core.errors import FocError

from .recorder import UNGUIDED

PARAMETERS, OPERATOR = 'parameters.yaml', 'operator.yaml'
"""Files of a session: the parameters that it began with, and those that were fitted to it."""
NICENESS = 10
COMPARE_COLUMNS = ('', 'before', 'after')
FITTED_COLUMNS = ('parameter', 'before', 'after')
QUESTIONS = {'way': 'path class', 'goal': 'goal'}


class CommandError(FocError):
    """A command that failed; the message is its last line."""


async def run_command(*arguments: str | Path) -> str:
    """Run a command of foc_ros and return its standard output; raises CommandError. It is ended when this is cancelled.

    A command that could not use some of the recordings has an answer all the same, and is no error.
    """
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *('-m', 'foc_ros', *map(str, arguments)),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        start_new_session=True,  # an interrupt of the terminal reaches this process, which then ends the other
    )
    try:
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
        output, errors = await process.communicate()
    finally:
        if process.returncode is None:
            process.terminate()
    if process.returncode and not output:
        lines = errors.decode(errors='replace').strip().splitlines()
        raise CommandError(lines[-1] if lines else f'foc_ros {arguments[0]} ended with exit code {process.returncode}')
    return output.decode()


async def fit_operator(folder: Path) -> tuple[list[tuple[str, str, str]], list[str], str]:
    """Fit the parameters to the trials without guidance, and write OPERATOR.

    Return a row of FITTED_COLUMNS for each parameter that has changed, a sentence for each horizon at which positions become
    worse with OPERATOR, and one about trials that could not be used.
    """
    options = '--params', folder / PARAMETERS, '--output', folder / OPERATOR, '--allow', 'positions', '--json'
    answer = json.loads(await run_command('fit', folder / UNGUIDED, *options))
    fitted = {**answer['parameters'], **answer['chosen']}
    rows = [(name, _format(each['given']), _format(each['value'])) for name, each in fitted.items()]
    return (
        [row for row in rows if row[1] != row[2]],
        find_worse_positions(answer['comparison']),
        _describe_unused(answer['failed']),
    )


async def compare_parameters(folder: Path, operator: Path) -> tuple[list[tuple[str, str, str]], str]:
    """Score the trials without guidance of a session, before and after a fit.

    Return rows of COMPARE_COLUMNS, and a sentence about trials that could not be used.
    """
    answers = [
        json.loads(await run_command('evaluate', folder / UNGUIDED, '--params', file, '--json'))
        for file in (folder / PARAMETERS, operator)
    ]
    before, after = map(summarise_evaluation, answers)
    rows = [(name, before[name], after.get(name, '-')) for name in before]
    return rows, _describe_unused({**answers[0]['failed'], **answers[1]['failed']})


def summarise_evaluation(answer: Mapping[str, Any]) -> dict[str, str]:
    """Return the main scores in an answer of `evaluate --json`."""
    rows = {}
    for question, words in QUESTIONS.items():
        if question in answer['questions']:
            scores = answer['questions'][question]['foc']
            rows[f'{words}: correct [%]'] = f'{100.0 * scores["right"]:.0f}'
            rows[f'{words}: log-likelihood [nat]'] = f'{scores["log_likelihood"]:.2f}'
    positions = answer['positions']
    displacement = positions['displacement_m']['likelihood-weighted']['average']['0.5']
    rows['mean displacement within 0.5 s (smaller is better) [mm]'] = '-' if displacement is None else f'{1e3 * displacement:.0f}'
    density = positions['nlpd']['foc']['0.5']
    rows['negative log-density of the position at 0.5 s (smaller is better) [nat]'] = '-' if density is None else f'{density:.2f}'
    return rows


def _describe_unused(failed: Mapping[str, str]) -> str:
    """Return a sentence that names trials and why they were not used, empty if all were."""
    return f' Not used: {", ".join(f"{name} ({reason})" for name, reason in failed.items())}.' if failed else ''


def _format(value: object) -> str:
    return f'{value:.4g}' if isinstance(value, float) else str(value)
