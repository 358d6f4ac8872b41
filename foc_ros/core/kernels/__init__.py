"""Kernels: how plain functions on numbers and arrays become machine code, and small linear algebra for them.

Enters: an annotated function. Leaves: its compiled kernel. It may import NumPy and Numba, and nothing of `foc_ros`.
"""

from .decorators import (
    Flags,
    FlagTable,
    Indices,
    Matrix,
    Register,
    Table,
    Tensor,
    Vector,
    compiled,
    compiled_exactly,
    compiled_exactly_with_caller,
    compiled_separately,
    compiled_with_caller,
    freeze,
)

__all__ = [
    'FlagTable',
    'Flags',
    'Indices',
    'Matrix',
    'Register',
    'Table',
    'Tensor',
    'Vector',
    'compiled',
    'compiled_exactly',
    'compiled_exactly_with_caller',
    'compiled_separately',
    'compiled_with_caller',
    'freeze',
]
