"""Kernels: plain functions on numbers, arrays and NamedTuples of them, compiled to machine code by numba.

There are two kinds. An entry kernel (`compiled`, `compiled_exactly`) is called from Python: it is compiled where it is defined,
for the types that its annotations name, and the machine code is kept beside the source, or in the user's cache directory where
that cannot be written. An inner kernel (`compiled_with_caller`) is called by other kernels only: it is compiled as part of each
entry kernel that needs it, for the types of that call, and it may be given NamedTuples that a kernel has built.
Called from Python, an inner kernel runs as Python.

The first import on a machine compiles all entry kernels, which takes some time. Numba checks only the file of an entry kernel for
changes, not the files of what it calls, so `forget_outdated` removes machine code that is older than any of these.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, ForwardRef, TypeAlias, TypeVar, cast

import numpy as np
from numba import config, njit, types
from numpy.typing import NDArray

from .libraries import EntryCompiler, InnerKernel

Vector: TypeAlias = NDArray[np.float64]
"""One axis, C-contiguous; like all arguments of entry kernels, it may be read-only."""
Matrix: TypeAlias = NDArray[np.float64]
"""Two axes, C-contiguous."""
Tensor: TypeAlias = NDArray[np.float64]
"""Three axes, C-contiguous."""
Indices: TypeAlias = NDArray[np.intp]
"""One axis of whole numbers, of any stride; contiguous in a NamedTuple."""
Table: TypeAlias = NDArray[np.intp]
"""Two axes of whole numbers."""
Flags: TypeAlias = NDArray[np.bool_]
"""One axis of truth values."""
FlagTable: TypeAlias = NDArray[np.bool_]
"""Two axes of truth values."""
Register: TypeAlias = NDArray[np.intp]
"""One axis of whole numbers that the kernel may write to."""

_TYPES = {
    'float': types.float64,
    'int': types.intp,
    'bool': types.boolean,
    'Vector': types.Array(types.float64, 1, 'C', readonly=True),
    'Matrix': types.Array(types.float64, 2, 'C', readonly=True),
    'Tensor': types.Array(types.float64, 3, 'C', readonly=True),
    'Indices': types.Array(types.intp, 1, 'A', readonly=True),
    'Table': types.Array(types.intp, 2, 'C', readonly=True),
    'Flags': types.Array(types.boolean, 1, 'C', readonly=True),
    'FlagTable': types.Array(types.boolean, 2, 'C', readonly=True),
    'Register': types.Array(types.intp, 1, 'C'),
}
_FIELD_TYPES = _TYPES | {'Indices': types.Array(types.intp, 1, 'C', readonly=True)}
"""In a NamedTuple a type has to match exactly: numba converts arrays from writeable to read-only or to any stride, not tuples."""
MACHINE_CODE = '*.nb[ic]'
"""Numba's files of machine code, named source.kernel-line.python.nbi and .nbc."""
SOURCE_OF_KERNELS = re.compile(rb'@compiled|\(NamedTuple\)')
"""Text in every source of a kernel, or of a NamedTuple that one takes; it occurs in this module too."""
REORDERED = {'contract', 'reassoc'}
"""What the compiler may change: the order of sums, and fused products. It may not assume that numbers are finite."""
COMMON: dict[str, Any] = {'error_model': 'numpy', 'no_cfunc_wrapper': True}
"""Options of all kernels. None is called from C."""
LEVEL = {'OPT': type(vars(config)['OPT'])(1), 'LOOP_VECTORIZE': 0}
"""Settings of numba for kernels. Its own, level 3, takes half as long again to compile, for kernels that are not faster."""


def forget_outdated(folder: Path) -> None:
    """Remove machine code in a folder and those below that is older than any source there of a kernel or its NamedTuples."""
    kept = list(folder.glob(f'**/__pycache__/{MACHINE_CODE}'))
    if not kept:
        return
    sources = [each for each in folder.glob('**/*.py') if SOURCE_OF_KERNELS.search(each.read_bytes())]
    changed = max((each.stat().st_mtime for each in sources), default=0.0)
    for each in kept:
        with suppress(OSError):  # another process was faster, or we may not remove the file
            if each.stat().st_mtime < changed:
                each.unlink()


forget_outdated(Path(__file__).parents[1])

Kernel = TypeVar('Kernel', bound=Callable[..., object])
Group = TypeVar('Group', bound=tuple[Any, ...])


def compiled(kernel: Kernel) -> Kernel:
    """Compile an entry kernel for the types that its annotations name.

    Parameters
    ----------
    kernel
        A function that does not write to its arguments and never raises. Each parameter is annotated by a number type, by an
        alias of this module, or by a NamedTuple class whose fields are annotated so. Numba accepts a NamedTuple only if all its
        arrays are C-contiguous and read-only: see `freeze`.
    """
    return _compile_entry(kernel, REORDERED)


def compiled_exactly(kernel: Kernel) -> Kernel:
    """Compile an entry kernel in which each product and sum is rounded as written, so that a b - b a is exactly zero."""
    return _compile_entry(kernel, set())


def compiled_with_caller(kernel: Kernel) -> Kernel:
    """Compile an inner kernel into each entry kernel that calls it, for the types of that call.

    It is inlined: passing on the arrays of a NamedTuple, which are counted references, took as long as the work in some of them.
    """
    return _make_inner(kernel, fastmath=REORDERED, forceinline=True)


def compiled_exactly_with_caller(kernel: Kernel) -> Kernel:
    """Compile an inner kernel like `compiled_with_caller`, in which each product and sum is rounded as written."""
    return _make_inner(kernel, fastmath=set(), forceinline=True)


def compiled_separately(kernel: Kernel) -> Kernel:
    """Compile an inner kernel for the types of its calls, not inlined: a large one takes long to compile in each caller."""
    return _make_inner(kernel, fastmath=REORDERED)


def freeze(group: Group) -> Group:
    """Make the arrays of a NamedTuple read-only, those of NamedTuples in it too, and return it for an entry kernel."""
    for each in group:
        if isinstance(each, np.ndarray):
            each.setflags(write=False)
        elif isinstance(each, tuple):
            freeze(each)
    return group


def _make_inner(kernel: Kernel, **options: object) -> Kernel:
    return cast('Kernel', InnerKernel(kernel, targetoptions={'nopython': True, 'no_cpython_wrapper': True, **options, **COMMON}))


def _compile_entry(kernel: Kernel, freedom: set[str]) -> Kernel:
    scope = kernel.__globals__
    signature = tuple(_find_type(each, scope, _TYPES) for name, each in kernel.__annotations__.items() if name != 'return')
    options = {'nogil': True, 'fastmath': freedom, **COMMON}
    with _compiler_at_level():
        try:
            return cast('Kernel', njit(signature, cache=True, pipeline_class=EntryCompiler, **options)(kernel))
        except RuntimeError as error:  # no directory to keep machine code in: compile in every process
            if 'cannot cache' not in str(error):
                raise
            return cast('Kernel', njit(signature, pipeline_class=EntryCompiler, **options)(kernel))


@contextmanager
def _compiler_at_level() -> Iterator[None]:
    """Set numba to the level of kernels, and back again for other code of this process."""
    before = {name: getattr(config, name) for name in LEVEL}
    vars(config).update(LEVEL)
    try:
        yield
    finally:
        vars(config).update(before)


def _find_type(annotation: object, scope: dict[str, Any], known: dict[str, types.Type]) -> types.Type:
    """Return the numba type of an annotation, a name in the scope of a module."""
    name = annotation.__forward_arg__ if isinstance(annotation, ForwardRef) else str(annotation)
    if name in known:
        return known[name]
    group = scope[name]
    inside = vars(sys.modules[group.__module__])
    fields = [_find_type(each, inside, _FIELD_TYPES) for each in group.__annotations__.values()]
    return cast('types.Type', types.BaseTuple.from_types(fields, group))  # type: ignore[no-untyped-call]
