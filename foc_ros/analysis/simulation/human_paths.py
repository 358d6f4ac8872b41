"""Recorded movements of people as intended paths of simulated operators, in the scenes of the recordings."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.interpolate import make_interp_spline

from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, RecordingError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import HAND
from foc_ros.ros.intake import Intake

from .intended_path import DT, IntendedPath
from .names import HUMAN_PATHS
from .operators import ARMS, Task

FEWEST_SAMPLES = 8


def read_tasks(recordings: Iterable[Recording], config: Config) -> list[Task]:
    """Return a task for each recording that can be used, in their order; raise InputError if there is none."""
    tasks = [task for recording in recordings if (task := read_task(recording, config)) is not None]
    if not tasks:
        raise InputError('--recordings', 'recordings with goals', 'none')
    return tasks


def read_task(recording: Recording, config: Config) -> Task | None:
    """Return the task of a recording: its path, its scene and, as the goal of the hand, the end of the path.

    None for a recording that cannot be read, that has few samples or no goals, or whose hand touches an obstacle by itself.
    """
    intake, samples = Intake(Pipeline(config)), []
    try:
        for item in recording.items():
            status = intake.take(item.role, item.message)
            if item.role == HAND and status is not None and status.is_taken and intake.sample is not None:
                samples.append(intake.sample)
    except RecordingError:
        return None
    scene = intake.pipeline.scene
    stamps, rows = np.unique([each.stamp_ns for each in samples], return_index=True)
    if len(rows) < FEWEST_SAMPLES or scene.goals is None or not len(scene.goals):
        return None
    times = (stamps - stamps[0]) / NANOSECONDS
    spline = make_interp_spline(times, np.array([samples[row].position for row in rows]), k=5)
    at = np.arange(0.0, times[-1], DT)
    path = IntendedPath(spline(at), spline(at, 1), spline(at, 2))
    obstacles, radius = scene.obstacles(int(stamps[-1])), config.scene.hand_radius
    if len(obstacles) and (measure_offsets(path.position, obstacles)[1] - obstacles.radius).min() <= radius:
        return None
    goal = path.position[-1]
    row = int(np.hypot(*(scene.goals - goal).T).argmin())
    return Task(ARMS[HUMAN_PATHS], obstacles, scene.goals, goal, row, path, radius)
