"""Machine code that is kept between two processes is never older than what it was made from."""

import os

import pytest

from foc_ros.core.kernels import forget_outdated


@pytest.mark.parametrize(('changed', 'stays'), [('callee.py', False), ('caller.py', False), ('other.py', True), (None, True)])
def test_machine_code_older_than_a_kernel_that_it_may_call_is_removed(tmp_path, changed, stays):
    """A kernel holds a copy of those it calls; `other.py` has no kernels."""
    below = tmp_path / 'below'
    for folder, source in ((tmp_path, 'caller'), (below, 'callee')):
        (folder / '__pycache__').mkdir(parents=True)
        for name in (f'{source}.py', f'__pycache__/{source}.kernel-1.py311.nbi', f'__pycache__/{source}.kernel-1.py311.1.nbc'):
            (folder / name).touch()
            os.utime(folder / name, (1.0, 1.0 if name.endswith('.py') else 2.0))
    (tmp_path / 'other.py').touch()
    if changed is not None:
        os.utime(next(tmp_path.rglob(changed)), (3.0, 3.0))
    forget_outdated(tmp_path)
    assert len(list(tmp_path.rglob('*.nb*'))) == (4 if stays else 0)
