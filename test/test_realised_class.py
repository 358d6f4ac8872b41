"""Every solved candidate passes the obstacles as its label says, by a check that uses neither constraint rows nor angles.

The suite solves a part of the 500 scenes. This command solves all of them and reports how the candidates ended:
`FOC_ROS_SCENES=500 python -m pytest test/test_realised_class.py --junit-xml=classes.xml`.
"""

import os
from collections import Counter

import numpy as np
import pytest
from homotopy_scenes import GOAL, random_scene

from foc_ros.core.config import Config, replace_values
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState, Obstacles, Prediction, make_obstacles

SCENES = int(os.environ.get('FOC_ROS_SCENES', '40'))
BATCHES = 4
K = 6


def count_crossings(path: np.ndarray, x: float, y: float) -> tuple[int, int]:
    """How often, in the direction of +x less the other way, a path crosses the line through (x, y) along y: above, below."""
    before, after = path[:-1, 0] < x, path[1:, 0] < x
    direction = before.astype(int) - after
    crossed = np.flatnonzero(direction)
    a, b = path[crossed], path[crossed + 1]
    height = a[:, 1] + (x - a[:, 0]) * (b[:, 1] - a[:, 1]) / (b[:, 0] - a[:, 0])
    return int(direction[crossed][height > y].sum()), int(direction[crossed][height <= y].sum())


def find_label(path: np.ndarray, obstacles: Obstacles) -> str:
    """Label of a path along +x that passes every obstacle."""
    signs = {}
    for identity, (x, y) in zip(obstacles.ids, obstacles.centre, strict=True):
        signs[identity] = {(1, 0): '+', (0, 1): '-'}[count_crossings(path, x, y)]
    return 'goal0:' + ''.join(signs[identity] + identity for identity in sorted(signs))


def solve_scene(seed: int, strategy: str) -> tuple[Prediction, Obstacles]:
    rng = np.random.default_rng(seed)
    circles = random_scene(rng, int(rng.integers(1, 9)))
    obstacles = make_obstacles(circles.centre, circles.radius, 0.001)
    config = replace_values(Config(), {'homotopy.max_candidates': K, 'foc.strategy': strategy})
    return predict(config, HandState(1, np.zeros(6), np.zeros((6, 6))), obstacles, GOAL[None], NO_TRACKS)[0], obstacles


@pytest.mark.parametrize('strategy', ['lv', 'optimal'])
@pytest.mark.parametrize('batch', range(BATCHES))
def test_solved_candidates_pass_as_their_labels_say(batch, strategy, record_testsuite_property):
    count = Counter()
    for seed in range(batch, SCENES, BATCHES):
        prediction, obstacles = solve_scene(seed, strategy)
        count['merged'] += prediction.notes.get('merged', 0)
        labels = [outcome.candidate.label for outcome in prediction.solved_candidates]
        assert len(set(labels)) == len(labels), f'scene {seed}'
        for outcome in prediction.candidates:
            count[outcome.solution.status.value] += 1
            if outcome.is_solved:
                assert find_label(outcome.solution.path, obstacles) == outcome.candidate.label, f'scene {seed}'
    record_testsuite_property(f'{strategy} {batch}', dict(count))
    assert count['solved'] > SCENES // BATCHES


def test_the_check_tells_left_from_right():
    obstacles = make_obstacles([[0.1, 0.0], [0.2, 0.0]], 0.01)
    path = np.array([[0.0, 0.0], [0.1, 0.05], [0.2, -0.05], [0.3, 0.0]])
    assert find_label(path, obstacles) == 'goal0:+0-1'
    assert find_label(path * [1, -1], obstacles) == 'goal0:-0+1'
