# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Solutions among mixed shapes lie in the homotopy class of their candidate, by the angles swept about the obstacles."""

import numpy as np
from homotopy_scenes import GOAL
from homotopy_shapes import HAND, random_shapes

from foc_ros.core.config import Config
from foc_ros.core.predict import build_scene_problems, solve_scene
from foc_ros.core.scene import ReachingScene
from foc_ros.core.solution import Status
from foc_ros.core.types import HandState

SCENES = 7
DURATION_S = 0.9


def make_scene(seed):
    rng = np.random.default_rng(seed)
    obstacles = random_shapes(rng, int(rng.integers(2, 6)))
    config = Config().with_values({'duration.fixed_s': DURATION_S, 'budget_s': 0.0})
    hand = HandState(0, np.concatenate((HAND, np.zeros(4))), np.zeros((6, 6)))
    return ReachingScene(hand, np.array([GOAL]), obstacles, None, None, config)


def sweep(path, point):
    """The angle that a path (n, 2) sweeps about a point [rad]."""
    angles = np.unwrap(np.arctan2(*(path - point).T[::-1]))
    return angles[-1] - angles[0]


def test_every_solved_candidate_is_in_the_class_of_its_label():
    counts = dict.fromkeys(Status, 0)
    for seed in range(SCENES):
        scene = make_scene(seed)
        for one in solve_scene(scene, build_scene_problems(scene)):
            counts[one.status] += 1
            if not one.has_likelihood:
                continue
            for name, _ in one.candidate.sides:
                centre = scene.obstacles.centre[scene.obstacles.ids.index(name)]
                difference = sweep(one.solution.path, centre) - sweep(one.candidate.guess, centre)
                assert abs(difference) < np.pi / 2, f'scene {seed}, {one.label}, obstacle {name}'
    found = sum(counts.values())
    assert found > 2 * SCENES
    assert counts[Status.LEFT_CLASS] <= 0.02 * found, counts
    assert counts[Status.SOLVED] + counts[Status.COMPROMISED] >= 0.94 * found, counts
