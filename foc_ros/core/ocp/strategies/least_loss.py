"""The point of a penalty path at which the loss from effort and missing safety is least: see `core.safety_preference`.

Along the path the effort does not fall, and k grows but for dips. The loss therefore falls as long as k is cheap, and rises
after that. It is sampled from the beginning of the path to where the wanted k is reached, or where the effort alone is a larger
loss than the least so far. Beside each sample that is lower than its neighbours the minimum is then sought by parabolas.
"""

from __future__ import annotations

from .penalty_path import STRIDE, PathFollower, PathPoint

FIRST_STRIDE = 0.5
"""First stride back from a warm start."""
PROBE = 1e-2
"""Distance in s from an end of the samples at which the loss tells whether it falls from there."""
APART = 0.05
"""Samples that are nearer to each other in s count as one."""
TOLERANCE = 2e-3
"""Distance in s at which the vertex of the parabola counts as the minimum: the loss differs by its square."""
MAX_TRIALS = 16


def compute_loss(follower: PathFollower, point: PathPoint) -> float:
    """Return the loss at a point."""
    return follower.problem.preference.compute_loss(point.effort, point.k, follower.problem.wanted_k)


def find_least_loss(follower: PathFollower, root: PathPoint | None) -> PathPoint:
    """Return the point with the least loss, from the points that a search for the root has solved.

    root: the point that meets the wanted k, None where the search found none. It is returned where it is the minimum.
    """
    if root is not None:
        if root.s > PROBE:
            follower.solve_beside(root.s - PROBE, root)
        if min(compute_loss(follower, each) for each in follower.points if each.s <= root.s) >= compute_loss(follower, root):
            return root
    _sample_before(follower)
    samples = _thin_out(follower.points, root)
    losses = [compute_loss(follower, each) for each in samples]
    found = [] if root is None else [root]
    for i, loss in enumerate(losses):
        if loss <= min(losses[max(i - 1, 0) : i + 2]):
            found.append(_refine(follower, samples, i))
    return min(found, key=lambda point: compute_loss(follower, point))


def _sample_before(follower: PathFollower) -> None:
    """Solve points from the smallest s so far back to the beginning of the path, which the follower remembers."""
    point: PathPoint | None = min(follower.points, key=lambda each: each.s)
    stride = FIRST_STRIDE
    while point is not None and point.s > 0.0:
        point = follower.solve_beside(max(point.s - stride, 0.0), point)
        stride = min(4 * stride, STRIDE)


def _thin_out(points: list[PathPoint], root: PathPoint | None) -> list[PathPoint]:
    """Return points below the wanted k in the order of s, up to the root, without those that are almost at the same s."""
    samples: list[PathPoint] = []
    for each in sorted(points, key=lambda point: point.s):
        if (not samples or each.s > samples[-1].s + APART) and (root is None or each.s < root.s - APART):
            samples.append(each)
    return samples if root is None else [*samples, root]


def _refine(follower: PathFollower, samples: list[PathPoint], i: int) -> PathPoint:
    """Return the minimum beside a sample whose loss is not above that of its neighbours."""
    middle = samples[i]
    low, high = samples[max(i - 1, 0)], samples[min(i + 1, len(samples) - 1)]
    if low is high:
        return middle
    if middle is low or middle is high:
        inside = follower.solve_beside(middle.s + (PROBE if middle is low else -PROBE), middle)
        if inside is None or compute_loss(follower, inside) >= compute_loss(follower, middle):
            return middle
        middle = inside
    return _minimise(follower, low, middle, high)


def _minimise(follower: PathFollower, low: PathPoint, middle: PathPoint, high: PathPoint) -> PathPoint:
    """Return the minimum between two points, from one between them whose loss is not above theirs.

    The next point is the vertex of the parabola through the three; every third one is the middle of the longer part, because at a
    kink the parabolas converge slowly.
    """
    for trial in range(MAX_TRIALS):
        s = _find_vertex(*((point.s, compute_loss(follower, point)) for point in (low, middle, high)))
        if trial % 3 == 2 or (abs(s - middle.s) < TOLERANCE and high.s - low.s > FIRST_STRIDE):
            s = (middle.s + (high.s if high.s - middle.s > middle.s - low.s else low.s)) / 2
        if abs(s - middle.s) < TOLERANCE:
            break
        point = follower.solve_beside(s, middle)
        if point is None:
            break
        if compute_loss(follower, point) <= compute_loss(follower, middle):
            low, middle, high = (middle, point, high) if s > middle.s else (low, point, middle)
        else:
            low, high = (low, point) if s > middle.s else (point, high)
    return middle


def _find_vertex(low: tuple[float, float], middle: tuple[float, float], high: tuple[float, float]) -> float:
    """Return the abscissa of the vertex of a parabola through three points, the middle one not above the others."""
    before, after = middle[0] - low[0], high[0] - middle[0]
    fall, rise = low[1] - middle[1], high[1] - middle[1]
    bend = before * rise + after * fall
    return middle[0] - 0.5 * (before * before * rise - after * after * fall) / bend if bend > 0.0 else middle[0]
