# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the page offers after a session: its report, a fit to it, and the scores before and after the fit; one at a time.

Fit and scores are commands of foc_ros in processes of their own, of low priority, which can be cancelled.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic
from typing import Any

from foc_ros.analysis.evaluation.scores import FEWEST
from foc_ros.analysis.fitting.fit import find_worse_positions, show_value
from foc_ros.core.errors import FocError, InputError

from .recording import OPERATOR, PARAMETERS, UNGUIDED, Recording

Note = Callable[[str], None]
"""Takes a line about the progress of a command."""


async def run_command(note: Note, *arguments: str | Path) -> str:
    """Run a command of foc_ros and return its standard output; FocError has its last line. It is ended when this is cancelled.

    A command that could not use some of the recordings has an answer all the same, and is no error.
    """
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *('-m', 'foc_ros', *map(str, arguments)),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        start_new_session=True,  # an interrupt of the terminal reaches this process, which then ends the other with its children
    )
    assert process.stdout is not None and process.stderr is not None
    lines = ['']
    try:
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process.pid, 10)
        output = asyncio.ensure_future(process.stdout.read())
        async for line in process.stderr:
            if text := line.decode(errors='replace').strip().removeprefix(f'foc_ros {arguments[0]}: '):
                lines.append(text)
                note(text)
        await process.wait()
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
            await process.wait()
        answer = (await output).decode()
    if process.returncode and not answer:
        raise FocError(lines[-1] or f'foc_ros {arguments[0]} ended with exit code {process.returncode}')
    return answer


class Jobs:
    """Runs one job at a time and tells the page how it goes.

    say: sends the page a message of a kind, with values; note_fitted: called when there are new fitted parameters, with whether
    they are to be used: no position becomes worse. Attributes: recording, of the last session, None before the first; report, the
    page of the last report; operator, the parameter file of the last fit.
    """

    def __init__(self, say: Callable[..., None], note_fitted: Callable[[bool], None]) -> None:
        self.recording: Recording | None = None
        self.report: Path | None = None
        self.operator: Path | None = None
        self._say, self._note_fitted = say, note_fitted
        self._job: asyncio.Task[None] | None = None
        self._began_s = 0.0

    def begin(self, name: str) -> None:
        """Begin a job by its name; raises InputError where it is impossible."""
        if self._job is not None and not self._job.done():
            raise InputError('job', 'one at a time', name)
        if self.recording is None:
            raise InputError('job', 'a session that was recorded', name)
        if name != 'report' and not self.recording.has_unguided:
            raise InputError('job', 'a session with trials without guidance', name)
        if name == 'compare' and self.operator is None:
            raise InputError('job', 'a fit before', name)
        self._began_s = monotonic()
        self._say('job', name=name, state='running', text='working', seconds=0.0)
        self._job = asyncio.ensure_future(self._run(name, self.recording))

    @property
    def seconds(self) -> float:
        """Time since the last job began [s]."""
        return round(monotonic() - self._began_s, 1)

    def cancel(self) -> None:
        """End the job that runs."""
        if self._job is not None:
            self._job.cancel()

    async def _run(self, name: str, recording: Recording) -> None:
        def say(state: str, text: str) -> None:
            self._say('job', name=name, state=state, text=text, seconds=self.seconds)

        work = {'report': self._write_report, 'fit': self._fit, 'compare': self._compare}[name]
        try:
            say('done', await work(recording, lambda text: say('running', text)))
        except asyncio.CancelledError:
            say('cancelled', 'cancelled')
            raise
        except Exception as error:
            say('failed', str(error))
            if not isinstance(error, FocError):
                raise

    async def _write_report(self, recording: Recording, _: Note) -> str:
        self.report = await asyncio.to_thread(recording.write_report)
        return 'The report is ready.'

    async def _fit(self, recording: Recording, note: Note) -> str:
        """Fit the parameters to the trials without guidance, and write OPERATOR."""
        folder = recording.folder
        options = '--params', folder / PARAMETERS, '--output', folder / OPERATOR, '--allow', 'positions', '--json'
        answer = json.loads(await run_command(note, 'fit', folder / UNGUIDED, *options))
        losses = find_worse_positions(answer['comparison'])
        self.operator = folder / OPERATOR
        self._note_fitted(not losses)
        fitted = {**answer['parameters'], **answer['chosen']}
        shown = [
            (name, each['given'], each['value']) for name, each in fitted.items() if str(each['given']) != str(each['value'])
        ]
        changed = [(name, show_value(given), show_value(value)) for name, given, value in shown]
        self._say('result', columns=('parameter', 'before', 'after'), rows=changed)
        text = 'Predictions now use your parameters.'
        if losses:
            words = '; '.join(losses)
            text = f'{words[0].upper()}{words[1:]}. Predictions use the standard parameters, unless you choose yours.'
        if answer['recordings'] < FEWEST:
            text += f' Durations and likelihoods keep their values: {FEWEST} trials or more are needed for them.'
        return text + _name_unused(answer['failed'])

    async def _compare(self, recording: Recording, note: Note) -> str:
        """Score the trials without guidance of a session, before and after a fit."""
        folder, operator = recording.folder, self.operator
        assert operator is not None
        answers = [
            json.loads(await run_command(note, 'evaluate', folder / UNGUIDED, '--params', file, '--json'))
            for file in (folder / PARAMETERS, operator)
        ]
        before, after = map(summarise_evaluation, answers)
        rows = [(name, before[name], after.get(name, '-')) for name in before]
        self._say('result', columns=('', 'before', 'after'), rows=rows)
        is_same = folder == operator.parent
        text = 'on the trials of the fit; record new trials for an independent comparison' if is_same else 'on new trials'
        return f'Before and after the fit, {text}.{_name_unused({**answers[0]["failed"], **answers[1]["failed"]})}'


def summarise_evaluation(answer: Mapping[str, Any]) -> dict[str, str]:
    """Return the main scores in an answer of `evaluate --json`."""
    rows = {}
    for question, words in (('way', 'path'), ('goal', 'goal')):
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


def _name_unused(failed: Mapping[str, str]) -> str:
    """Return a sentence that names trials and why they were not used, empty if all were."""
    return f' Not used: {", ".join(f"{name} ({reason})" for name, reason in failed.items())}.' if failed else ''
