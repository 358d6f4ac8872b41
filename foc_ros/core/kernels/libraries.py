"""How kernels are compiled: what an entry kernel (`@compiled`) calls is linked to it, and optimised with it, once.

Numba makes machine code of every function that a kernel calls, its own functions for arrays too, after it has linked and
optimised all that this function calls. The machine code of an inner function is never called, and its callers repeat the
optimisation. Here an inner function is intermediate code and a list of the functions that it calls, and only entry kernels become
machine code. The classes derive from numba's and override a few internal methods.
"""

# mypy: allow-untyped-calls
# ruff: noqa: SLF001 (numba has no public way to its libraries)

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher


class InnerLibrary(JITCodeLibrary):
    """Intermediate code of a function that is not called from Python."""

    @property
    def codegen(self) -> Any:
        """Return an object that ignores environments: only machine code has one."""
        return _NoEngine()

    def get_pointer_to_function(self, _: str) -> int:
        """Return that there is no machine code."""
        return 0

    def finalize(self) -> None:
        """Let every library that links this one have a copy of the functions."""
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == 'external':
                function.linkage = 'linkonce_odr'
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        self._ensure_finalized()
        return self._final_module

    @classmethod
    def _unserialize(cls, codegen: JITCPUCodegen, state: object) -> Any:
        """Load an entry kernel from the cache, which has machine code."""
        with _make_libraries(codegen, JITCodeLibrary):
            return JITCodeLibrary._unserialize(codegen, state)


class EntryLibrary(JITCodeLibrary):
    """Machine code of an entry kernel and all that it calls."""

    def finalize(self) -> None:
        """Link what the inner functions call, too, and make the machine code."""
        found: dict[Any, None] = {}
        _collect_called(self, found)
        self._linking_libraries = list(reversed(found))  # callers first: LLVM leaves out what nothing has called yet
        super().finalize()


class EntryCompiler(Compiler):
    """Numba's compiler, with these libraries."""

    def compile_extra(self, kernel: Callable[..., object]) -> Any:
        """Compile an entry kernel."""
        codegen = self.state.targetctx.codegen()
        self.state.library = EntryLibrary(codegen, kernel.__qualname__)
        self.state.library.enable_object_caching()
        with _make_libraries(codegen, InnerLibrary), _collect_new_garbage():
            return super().compile_extra(kernel)


class InnerKernel(CPUDispatcher):
    """A kernel that is compiled as part of others; called from Python, it runs as Python."""

    def __call__(self, *arguments: object) -> object:
        """Run the function as it is written."""
        return cast('Callable[..., object]', self.py_func)(*arguments)


class _NoEngine:
    def set_env(self, _name: str, _environment: object) -> None:
        """Do nothing."""


def _collect_called(library: Any, found: dict[Any, None]) -> None:
    """Collect what a library calls, and what that calls, callees first."""
    for each in library._linking_libraries:
        if each not in found:
            if isinstance(each, InnerLibrary):
                _collect_called(each, found)
            found[each] = None


@contextmanager
def _collect_new_garbage() -> Iterator[None]:
    """Exclude the objects that exist now from garbage collection, which otherwise takes a tenth of the time to compile.

    Objects that a program has frozen itself stay frozen.
    """
    if gc.get_freeze_count():
        yield
        return
    gc.freeze()
    try:
        yield
    finally:
        gc.collect()
        gc.unfreeze()


@contextmanager
def _make_libraries(codegen: Any, kind: type[JITCodeLibrary]) -> Iterator[None]:
    """Let numba make libraries of a kind."""
    before = codegen._library_class
    codegen._library_class = kind
    try:
        yield
    finally:
        codegen._library_class = before
