"""What the page offers after a session: its report, a fit to it, and the scores before and after the fit; one at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Any

from foc_ros.core.errors import FocError, InputError

from . import jobs
from .recorder import UNGUIDED
from .session_report import SessionReport


class AfterSession:
    """Runs one job at a time and tells the page how it goes.

    Attributes: folder, of the last session, None before the first; report, the page of the last report; operator, the parameter
    file of the last fit.

    Parameters
    ----------
    say
        Sends the page a message of a kind, with values.
    note_fitted
        Called when there are new fitted parameters, with whether they are to be used: no position becomes worse.
    """

    def __init__(self, say: Callable[..., None], note_fitted: Callable[[bool], None]) -> None:
        self.folder: Path | None = None
        self.report: Path | None = None
        self.operator: Path | None = None
        self._say, self._note_fitted = say, note_fitted
        self._reported = SessionReport()
        self._job: asyncio.Task[None] | None = None

    def begin_session(self, folder: Path, report: SessionReport) -> None:
        """Work on a new session from now on; report: what collects its report."""
        self.folder, self._reported = folder, report

    def begin(self, name: str) -> None:
        """Begin a job by its name; raises InputError where it is impossible."""
        if self._job is not None and not self._job.done():
            raise InputError('job', 'one at a time', name)
        if self.folder is None:
            raise InputError('job', 'a session that was recorded', name)
        if name != 'report' and not (self.folder / UNGUIDED).is_dir():
            raise InputError('job', 'a session with trials without guidance', name)
        if name == 'compare' and self.operator is None:
            raise InputError('job', 'a fit before', name)
        self._say('job', name=name, state='running')
        self._job = asyncio.ensure_future(self._run(name, self.folder))

    def cancel(self) -> None:
        """End the job that runs."""
        if self._job is not None:
            self._job.cancel()

    async def _run(self, name: str, folder: Path) -> None:
        began = monotonic()
        try:
            answer = await {'report': self._write_report, 'fit': self._fit, 'compare': self._compare}[name](folder)
            self._say('job', name=name, state='done', seconds=round(monotonic() - began, 1), **answer)
        except Exception as error:
            self._say('job', name=name, state='failed', text=str(error))
            if not isinstance(error, FocError):
                raise

    async def _write_report(self, folder: Path) -> dict[str, Any]:
        await asyncio.to_thread(self._reported.write, folder / 'report', f'Session {folder.name}')
        self.report = folder / 'report' / 'index.html'
        return {'text': 'The report is ready.'}

    async def _fit(self, folder: Path) -> dict[str, Any]:
        rows, losses, unused = await jobs.fit_operator(folder)
        self.operator = folder / jobs.OPERATOR
        self._note_fitted(not losses)
        text = 'Predictions now use your parameters.'
        if losses:
            text = f'{"; ".join(losses)}. Predictions use the standard parameters, unless you choose yours above.'
        return {'text': text[0].upper() + text[1:] + unused, 'columns': jobs.FITTED_COLUMNS, 'rows': rows}

    async def _compare(self, folder: Path) -> dict[str, Any]:
        assert self.operator is not None
        rows, unused = await jobs.compare_parameters(folder, self.operator)
        is_same = folder == self.operator.parent
        text = 'on the trials of the fit; record new trials for an independent comparison' if is_same else 'on new trials'
        return {'text': f'Before and after the fit, {text}.{unused}', 'columns': jobs.COMPARE_COLUMNS, 'rows': rows}
