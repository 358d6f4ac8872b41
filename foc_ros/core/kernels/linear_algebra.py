"""Small dense linear algebra for the kernels: products of rows, Cholesky factors, triangular solves.

The matrices have 2 to 12 rows and up to 2N = 100 columns. Each docstring says how many times as long numpy's function takes
inside a numba kernel, measured for 2, 6 and 12 rows. Numpy also raises for a matrix that is not positive definite, where a kernel
has to go on.
"""

from __future__ import annotations

import numpy as np

from .decorators import Matrix, Vector, compiled, compiled_separately


@compiled
def multiply_transposed(a: Matrix, b: Matrix) -> Matrix:
    """Return a b', (m, n), for rows a (m, q) and b (n, q); a @ b.T takes 5.6, 2.9 and 1.6 times as long with 6 rows of b."""
    m, n, q = a.shape[0], b.shape[0], a.shape[1]
    product = np.empty((m, n))
    for i in range(m):
        for j in range(n):
            total = 0.0
            for k in range(q):
                total += a[i, k] * b[j, k]
            product[i, j] = total
    return product


@compiled
def multiply_weighted(a: Matrix, weights: Vector) -> Matrix:
    """Return a D a', (m, m), for rows a (m, q) and the diagonal (q,) of D; half of it is computed, as it is symmetric."""
    m, q = a.shape
    product, row = np.empty((m, m)), np.empty(q)
    for i in range(m):
        for k in range(q):
            row[k] = weights[k] * a[i, k]
        for j in range(i + 1):
            total = 0.0
            for k in range(q):
                total += row[k] * a[j, k]
            product[i, j] = product[j, i] = total
    return product


@compiled
def multiply(weights: Matrix, rows: Matrix) -> Matrix:
    """Return weights @ rows, (m, q), for weights (m, n) and rows (n, q); numpy takes 2.3, 1.9 and 1.0 times as long for n = 6."""
    m, n, q = weights.shape[0], rows.shape[0], rows.shape[1]
    total = np.zeros((m, q))
    for i in range(m):
        for j in range(n):
            weight = weights[i, j]
            for k in range(q):
                total[i, k] += weight * rows[j, k]
    return total


@compiled
def multiply_vector(matrix: Matrix, vector: Vector) -> Vector:
    """Return matrix @ vector, (m,); numpy takes 3.2, 2.2 and 1.7 times as long."""
    m, q = matrix.shape
    product = np.empty(m)
    for i in range(m):
        total = 0.0
        for k in range(q):
            total += matrix[i, k] * vector[k]
        product[i] = total
    return product


@compiled
def factorise_cholesky(matrix: Matrix, floor: float) -> Matrix:
    """Return the lower L with L L' = matrix (n, n), every squared pivot at least the floor.

    With floor 0, a matrix that is not positive definite gives a NaN. `linalg.cholesky` takes 1.8, 1.6 and 0.8 times as long; with
    both triangular solves, numpy takes 3.8, 4.0 and 5.3 times as long.
    """
    n = matrix.shape[0]
    factor = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            left = matrix[i, j]
            for k in range(j):
                left -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = left / factor[j, j]
            elif left > floor:
                factor[i, i] = np.sqrt(left)
            else:
                factor[i, i] = np.sqrt(floor) if floor > 0 else np.nan
    return factor


@compiled
def solve_lower(factor: Matrix, right: Matrix) -> Matrix:
    """Return L^-1 right, (n, q), for a lower L (n, n); `linalg.solve` takes 5.2, 5.2 and 6.7 times as long for q = n."""
    n, q = right.shape
    solved = right.copy()
    for i in range(n):
        for j in range(i):
            weight = factor[i, j]
            for k in range(q):
                solved[i, k] -= weight * solved[j, k]
        for k in range(q):
            solved[i, k] /= factor[i, i]
    return solved


@compiled
def solve_lower_transposed(factor: Matrix, right: Vector) -> Vector:
    """Return L'^-1 right, (n,), for a lower L (n, n); `linalg.solve` takes 6.6, 8.8 and 12 times as long."""
    n = right.shape[0]
    solved = right.copy()
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            solved[i] -= factor[j, i] * solved[j]
        solved[i] /= factor[i, i]
    return solved


@compiled_separately
def solve_by_elimination(matrix: Matrix, right: Vector) -> tuple[float, Vector]:
    """Solve a system (n, n) by Gaussian elimination in place; return the sign of the determinant and the solution (n,).

    Rows are first divided by their largest entry. The sign is 0 if the matrix is singular.
    """
    n, sign = len(right), 1.0
    for i in range(n):
        largest = np.abs(matrix[i]).max()
        if not 0.0 < largest < np.inf:
            return 0.0, right
        matrix[i] /= largest
        right[i] /= largest
    for i in range(n):
        pivot = i
        for j in range(i + 1, n):
            if abs(matrix[j, i]) > abs(matrix[pivot, i]):
                pivot = j
        if matrix[pivot, i] == 0.0:
            return 0.0, right
        sign = -sign if (matrix[pivot, i] < 0.0) != (pivot != i) else sign
        for j in range(i, n):
            matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
        right[i], right[pivot] = right[pivot], right[i]
        for j in range(i + 1, n):
            factor = matrix[j, i] / matrix[i, i]
            if factor != 0.0:
                for column in range(i + 1, n):
                    matrix[j, column] -= factor * matrix[i, column]
                right[j] -= factor * right[i]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]
    return sign, right
