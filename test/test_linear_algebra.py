"""The linear algebra of the kernels against numpy, and compilation where machine code cannot be kept."""

import numpy as np
import pytest

from foc_ros.core.kernels import compiled, linear_algebra

GENERATOR = np.random.default_rng(4)
A, B = GENERATOR.normal(size=(5, 7)), GENERATOR.normal(size=(3, 7))
POSITIVE = A @ A.T
LOWER = np.linalg.cholesky(POSITIVE)


def test_products():
    np.testing.assert_allclose(linear_algebra.multiply_transposed(A, B), A @ B.T, atol=1e-14)
    np.testing.assert_allclose(linear_algebra.multiply(A.T.copy(), A), A.T @ A, atol=1e-14)
    np.testing.assert_allclose(linear_algebra.multiply_vector(A, B[0]), A @ B[0], atol=1e-14)


def test_cholesky_and_its_solves():
    np.testing.assert_allclose(linear_algebra.factorise_cholesky(POSITIVE, 0.0), LOWER, atol=1e-13)
    np.testing.assert_allclose(LOWER @ linear_algebra.solve_lower(LOWER, A), A, atol=1e-13)
    np.testing.assert_allclose(LOWER.T @ linear_algebra.solve_lower_transposed(LOWER, A[:, 0].copy()), A[:, 0], atol=1e-13)


def test_a_matrix_that_is_not_positive_gives_nan_or_the_floor():
    singular = np.ones((2, 2))
    assert np.isnan(linear_algebra.factorise_cholesky(singular, 0.0)[1, 1])
    assert linear_algebra.factorise_cholesky(singular, 1e-14)[1, 1] == pytest.approx(1e-7)


def test_read_only_and_empty_arrays_are_accepted():
    frozen = A.copy()
    frozen.flags.writeable = False
    np.testing.assert_allclose(linear_algebra.multiply_transposed(frozen, frozen), POSITIVE, atol=1e-14)
    assert linear_algebra.multiply_transposed(np.empty((0, 7)), A).shape == (0, 5)


def test_a_kernel_whose_machine_code_cannot_be_kept_is_compiled_all_the_same():
    """Numba finds no directory for a function without a file, as for a package on a read-only disk."""
    namespace = {'compiled': compiled}
    exec("def double(x): return 2 * x\ndouble.__annotations__ = {'x': 'float'}\ndouble = compiled(double)", namespace)
    assert namespace['double'](1.5) == 3.0
