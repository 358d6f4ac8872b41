# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The notebook runs from its first cell to its last, its stored outputs are those of the present program, and the likelihood of
the path that the hand takes rises.

`python test/test_notebook.py` stores the outputs anew.
"""

import os
import re
import sys
from pathlib import Path

import pytest

nbclient = pytest.importorskip('nbclient', reason='nbclient is not installed')
nbformat = pytest.importorskip('nbformat', reason='nbformat is not installed')
pytest.importorskip('ipykernel', reason='ipykernel is not installed')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

NOTEBOOK = Path(__file__).parents[1] / 'examples' / 'first_steps.ipynb'
CELL_S = 280
"""Time limit of a cell: seconds, and minutes on a busy machine."""


def execute(folder, *more):
    """Return the notebook with the outputs of its cells, and of cells that are appended, run in a folder."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    notebook.cells += [nbformat.v4.new_code_cell(source) for source in more]
    options = {'timeout': CELL_S, 'record_timing': False, 'resources': {'metadata': {'path': str(folder)}}}
    nbclient.NotebookClient(notebook, **options).execute()
    return notebook


def list_outputs(notebook):
    """Return the text of each output, and the type of each picture."""
    outputs = [output for cell in notebook.cells for output in cell.get('outputs', ())]
    assert not [output for output in outputs if output['output_type'] == 'error' or output.get('name') == 'stderr']
    shown = [{'text/plain': output['text']} if 'text' in output else output['data'] for output in outputs]
    texts = [' '.join([*sorted(data), data.get('text/plain', '')]) for data in shown]
    # the size of a picture follows its data to the last digit
    return [re.sub(r'(<Figure size \d+)x\d+\.\d+', r'\1', text) for text in texts]


@pytest.mark.timeout(2 * CELL_S)
def test_the_notebook_runs_and_keeps_its_outputs(monkeypatch, tmp_path):
    for name in ('IPYTHONDIR', 'JUPYTER_RUNTIME_DIR', 'MPLCONFIGDIR'):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join([str(NOTEBOOK.parents[1]), os.environ.get('PYTHONPATH', '')]))
    notebook = execute(tmp_path, 'print(left[0], left[-1])')
    *outputs, shares = list_outputs(notebook)
    assert outputs == list_outputs(nbformat.read(NOTEBOOK, as_version=4)), f'python {Path(__file__).name} stores them anew'
    assert sum('image/png' in output for output in outputs) == 2
    first, last = map(float, shares.split()[1:])
    assert last > max(first, 0.9)


def store():
    """Write the notebook with its outputs, without what differs from one machine to the next."""
    notebook = execute(NOTEBOOK.parent)
    notebook.metadata.language_info = {'name': 'python'}
    nbformat.write(notebook, NOTEBOOK)


if __name__ == '__main__':
    sys.exit(store())
