"""Machine code that is kept between two processes is never older than its sources, and kernels take NamedTuples."""

from __future__ import annotations

import gc
import os
import sys
from importlib import import_module
from typing import NamedTuple

import numpy as np
import pytest

from foc_ros.core.kernels import Matrix, Vector, compiled, compiled_with_caller, freeze
from foc_ros.core.kernels.compilation import count_kernels, follow_compilation
from foc_ros.core.kernels.decorators import forget_outdated
from foc_ros.core.kernels.libraries import InnerLibrary

KERNEL, GROUP = '@compiled\ndef kernel(): ...', 'class Group(NamedTuple): ...'


@pytest.mark.parametrize(
    ('changed', 'stays'),
    [('callee.py', False), ('caller.py', False), ('inner.py', False), ('group.py', False), ('other.py', True), (None, True)],
)
def test_machine_code_older_than_any_source_of_a_kernel_is_removed(tmp_path, changed, stays):
    """A kernel contains a copy of the kernels that it calls, with code of their own or without, and of its argument types."""
    below = tmp_path / 'below'
    for folder, source in ((tmp_path, 'caller'), (below, 'callee')):
        (folder / '__pycache__').mkdir(parents=True)
        (folder / f'{source}.py').write_text(KERNEL)
        for name in (f'{source}.py', f'__pycache__/{source}.kernel-1.py311.nbi', f'__pycache__/{source}.kernel-1.py311.1.nbc'):
            (folder / name).touch()
            os.utime(folder / name, (1.0, 1.0 if name.endswith('.py') else 2.0))
    for name, text in (('inner', KERNEL.replace('@compiled', '@compiled_with_caller')), ('group', GROUP), ('other', 'x = 1')):
        (below / f'{name}.py').write_text(text)
        os.utime(below / f'{name}.py', (1.0, 1.0))
    if changed is not None:
        os.utime(next(tmp_path.rglob(changed)), (3.0, 3.0))
    forget_outdated(tmp_path)
    assert len(list(tmp_path.rglob('*.nb*'))) == (4 if stays else 0)


class Line(NamedTuple):
    points: Matrix
    weight: float


class Lines(NamedTuple):
    first: Line
    offset: Vector


@compiled_with_caller
def weigh(line: Line) -> Line:
    return Line(line.points * line.weight, 1.0)


@compiled
def add_up(lines: Lines, times: int) -> tuple[float, Line]:
    line = weigh(lines.first)
    for _ in range(times):
        line = weigh(line)
    return line.points.sum() + lines.offset.sum(), line


def test_an_entry_kernel_takes_nested_tuples_and_an_inner_one_those_that_a_kernel_has_built():
    points = np.arange(6.0).reshape(3, 2)
    total, line = add_up(freeze(Lines(Line(points, 2.0), np.ones(4))), 3)
    assert total == 2 * 15 + 4
    assert isinstance(line, Line)
    np.testing.assert_array_equal(line.points, 2 * points)


def test_a_tuple_that_is_not_frozen_is_refused():
    with pytest.raises(TypeError, match='No matching definition'):
        add_up(Lines(Line(np.zeros((3, 2)), 2.0), np.ones(4)), 3)


def test_the_compilation_of_kernels_is_followed_and_happens_once(tmp_path, monkeypatch):
    (tmp_path / 'followed_kernel.py').write_text(
        'from __future__ import annotations\nfrom foc_ros.core.kernels import compiled, compiled_with_caller\n'
        '@compiled_with_caller\ndef half(number: float) -> float:\n    return number / 2.0\n'
        '@compiled\ndef quarter(number: float) -> float:\n    return half(half(number))\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    reported = []
    for _ in range(2):
        with follow_compilation(reported.append):
            assert import_module('followed_kernel').quarter(2.0) == 0.5
        del sys.modules['followed_kernel']
    assert reported == [0, 1]
    assert count_kernels() > 10


def test_an_inner_kernel_becomes_machine_code_only_as_part_of_an_entry_kernel(tmp_path, monkeypatch):
    """Machine code of its own would be compiled, and what it calls optimised again, for nobody."""
    (tmp_path / 'kernel_in_kernel.py').write_text(
        'from foc_ros.core.kernels import compiled, compiled_separately, compiled_with_caller\n'
        '@compiled_with_caller\ndef half(number: "float") -> "float":\n    return number / 2.0\n'
        '@compiled_separately\ndef quarter(number: "float") -> "float":\n    return half(half(number))\n'
        '@compiled\ndef sixteenth(number: "float") -> "float":\n    return quarter(quarter(number))\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    kernels = import_module('kernel_in_kernel')
    assert kernels.sixteenth(2.0) == 0.125
    for kernel in (kernels.half, kernels.quarter):
        (only,) = kernel.overloads.values()
        assert isinstance(only.library, InnerLibrary)
        assert only.library.get_pointer_to_function(only.fndesc.llvm_func_name) == 0
    del sys.modules['kernel_in_kernel']


def test_compiling_leaves_no_object_that_the_garbage_collector_ignores(tmp_path, monkeypatch):
    (tmp_path / 'collected_kernel.py').write_text(
        'from foc_ros.core.kernels import compiled\n@compiled\ndef double(number: "float") -> "float":\n    return 2.0 * number\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    frozen = []
    with monkeypatch.context() as patch:
        collect = gc.collect
        patch.setattr(gc, 'collect', lambda: frozen.append(gc.get_freeze_count()) or collect())
        assert import_module('collected_kernel').double(2.0) == 4.0
    del sys.modules['collected_kernel']
    assert frozen and frozen[0] > 10000, 'what numba keeps is not looked at'
    assert gc.get_freeze_count() == 0


def test_an_inner_kernel_that_is_called_from_python_runs_as_python():
    line = weigh(Line(np.ones((1, 2)), 3.0))
    np.testing.assert_array_equal(line.points, [[3.0, 3.0]])
