"""Messages to the page as plain values: what it has to know at the beginning, and how the tasks go."""

from __future__ import annotations

from typing import Any

from foc_ros.core.config import Config
from foc_ros.reporting.draw import CLASS_COLOURS

from . import scene
from .tasks import Phase, Tasks


def make_hello(predictor: str, config: Config) -> dict[str, Any]:
    """Return the first message to a page; predictor: its name."""
    return {
        'type': 'hello',
        'predictor': predictor,
        'colours': CLASS_COLOURS,
        'bounds': scene.BOUNDS,
        'start': scene.START,
        'target_radius': scene.TARGET_RADIUS,
        'radius_stddev': scene.RADIUS_STDDEV,
        'first_scene': scene.FIRST_SCENE.as_json(),
        'most': {'obstacles': scene.MOST_OBSTACLES, 'goals': scene.MOST_GOALS},
        'max_speed': config.guidance.max_speed,
        # with a spring that is as stiff as guidance at most, the loop of cursor and guidance is stable at any delay
        'coupling': max(config.guidance.k_max, 1.0),
    }


def make_task(running: Tasks | None) -> dict[str, Any]:
    """Return the message about the present trial, or that no tasks run."""
    if running is None:
        return {'type': 'task', 'phase': 'none'}
    return {
        'type': 'task',
        'phase': running.phase.value,
        'trial': running.number + 1,
        'trials': len(running.trials),
        'goal': running.trial.goal if running.phase is Phase.REACH else None,
        'blinded': running.settings.is_blinded,
    }
