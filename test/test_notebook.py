"""The notebook runs from its first cell to its last, and the likelihood of the way that the hand takes rises."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

nbclient = pytest.importorskip('nbclient', reason='nbclient is not installed')
nbformat = pytest.importorskip('nbformat', reason='nbformat is not installed')
pytest.importorskip('ipykernel', reason='ipykernel is not installed')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

NOTEBOOK = Path(__file__).parents[1] / 'examples' / 'first_steps.ipynb'
CELL_S = 280
"""Time limit of a cell: seconds, and minutes on a busy machine."""


@pytest.mark.timeout(2 * CELL_S)
def test_the_notebook_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ('IPYTHONDIR', 'JUPYTER_RUNTIME_DIR', 'MPLCONFIGDIR'):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join([str(NOTEBOOK.parents[1]), os.environ.get('PYTHONPATH', '')]))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get('outputs') for cell in notebook.cells), 'the notebook is kept without its outputs'
    notebook.cells.append(nbformat.v4.new_code_cell('print(left[0], left[-1])'))
    nbclient.NotebookClient(notebook, timeout=CELL_S, resources={'metadata': {'path': str(tmp_path)}}).execute()
    pictures = [output for cell in notebook.cells for output in cell.get('outputs', ()) if 'image/png' in output.get('data', {})]
    assert len(pictures) == 2
    first, last = map(float, notebook.cells[-1].outputs[0].text.split())
    assert last > max(first, 0.9)
