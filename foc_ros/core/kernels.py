"""Kernels in machine code: plain functions on arrays, compiled by numba where they are defined.

The first import on a machine compiles them, which takes some seconds; numba keeps the result beside the source, or in the user's
cache directory where that cannot be written. Numba looks only at the file of a kernel, not at those that it calls, so what is
older than any of them is removed from beside the sources here.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias, TypeVar, cast

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

Vector: TypeAlias = NDArray[np.float64]
Matrix: TypeAlias = NDArray[np.float64]
Tensor: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]
Table: TypeAlias = NDArray[np.intp]
Points: TypeAlias = NDArray[np.complex128]
PointTable: TypeAlias = NDArray[np.complex128]
Flags: TypeAlias = NDArray[np.bool_]
FlagTable: TypeAlias = NDArray[np.bool_]
"""Arguments of kernels: C-contiguous arrays, tables of two axes, a tensor of three, indices of any stride; read-only ones too."""
Scratch: TypeAlias = NDArray[np.float64]
Register: TypeAlias = NDArray[np.intp]
"""Arrays of a kernel's own that it lends to another one to write to."""

_TYPES = {
    'float': types.float64,
    'int': types.intp,
    'bool': types.boolean,
    'complex': types.complex128,
    'Vector': types.Array(types.float64, 1, 'C', readonly=True),
    'Matrix': types.Array(types.float64, 2, 'C', readonly=True),
    'Tensor': types.Array(types.float64, 3, 'C', readonly=True),
    'Indices': types.Array(types.intp, 1, 'A', readonly=True),
    'Table': types.Array(types.intp, 2, 'C', readonly=True),
    'Points': types.Array(types.complex128, 1, 'C', readonly=True),
    'PointTable': types.Array(types.complex128, 2, 'C', readonly=True),
    'Flags': types.Array(types.boolean, 1, 'C', readonly=True),
    'FlagTable': types.Array(types.boolean, 2, 'C', readonly=True),
    'Scratch': types.Array(types.float64, 1, 'C'),
    'Register': types.Array(types.intp, 1, 'C'),
}
KEPT = '*.nb[ic]'
"""Numba's files of machine code, named source.kernel-line.python.nbi and .nbc."""
REORDERED = {'contract', 'reassoc'}
"""Freedom of the compiler: sums in another order, fused products. Not that numbers are finite."""


def forget_outdated(folder: Path) -> None:
    """Remove kept machine code that is older than the source of any kernel in a folder and those below."""
    kept = list(folder.glob(f'**/__pycache__/{KEPT}'))
    sources = {each.parent.parent / f'{each.name.partition(".")[0]}.py' for each in kept}
    changed = max((each.stat().st_mtime for each in sources if each.exists()), default=0.0)
    for each in kept:
        with suppress(OSError):  # another process was faster, or it is not ours to remove
            if each.stat().st_mtime < changed:
                each.unlink()


forget_outdated(Path(__file__).parent)

Kernel = TypeVar('Kernel', bound=Callable[..., object])


def compiled(kernel: Kernel) -> Kernel:
    """Compile a function for the types that its annotations name; it changes only what it is lent and never raises."""
    return _compiled(kernel, REORDERED)


def compiled_exactly(kernel: Kernel) -> Kernel:
    """Compile one whose signs and ties decide: every product and sum is rounded as it stands, so that a b - b a is zero."""
    return _compiled(kernel, set())


def _compiled(kernel: Kernel, freedom: set[str]) -> Kernel:
    signature = tuple(_TYPES[str(kind)] for name, kind in kernel.__annotations__.items() if name != 'return')
    try:
        return cast('Kernel', njit(signature, cache=True, fastmath=freedom, error_model='numpy')(kernel))
    except RuntimeError as error:  # no directory to keep it in: compile in every process
        if 'cannot cache' not in str(error):
            raise
        return cast('Kernel', njit(signature, fastmath=freedom, error_model='numpy')(kernel))
