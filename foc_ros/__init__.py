"""foc_ros predicts where an operator's hand is going among obstacles, with its uncertainty.

This module is the public Python API. Lengths are in metres, times in seconds, positions in the task plane. Names are imported
when they are first used, so that `import foc_ros` alone is fast.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING, Any

__version__ = '0.1.0'

if TYPE_CHECKING:
    from foc_ros.analysis.evaluation import register_baseline
    from foc_ros.api import (
        Prediction,
        Predictor,
        Solution,
        load_config,
        monte_carlo,
        plot_candidates,
        register_likelihood_rule,
        register_plant,
        register_qp_backend,
        register_strategy,
        replay,
        solve,
        solve_classes,
    )
    from foc_ros.core.config import Config
    from foc_ros.core.dynamics.plant_models import PlantModel
    from foc_ros.core.dynamics.plants import Plant
    from foc_ros.core.errors import FocError, InputError, MessageError, ParameterError, RecordingError, SceneError
    from foc_ros.core.obstacles.shapes import Circle
    from foc_ros.core.ocp.monte_carlo import MonteCarlo
    from foc_ros.core.types import Candidate, HandState, Obstacles, PredictedCandidate, Status

_MODULES = {
    'foc_ros.api': (
        'Prediction Predictor Solution load_config monte_carlo plot_candidates register_likelihood_rule register_plant'
        ' register_qp_backend register_strategy replay solve solve_classes'
    ),
    'foc_ros.core.config': 'Config',
    'foc_ros.core.dynamics.plant_models': 'PlantModel',
    'foc_ros.core.dynamics.plants': 'Plant',
    'foc_ros.core.errors': 'FocError InputError MessageError ParameterError RecordingError SceneError',
    'foc_ros.core.obstacles.shapes': 'Circle',
    'foc_ros.core.ocp.monte_carlo': 'MonteCarlo',
    'foc_ros.core.types': 'Candidate HandState Obstacles PredictedCandidate Status',
    'foc_ros.analysis.evaluation': 'register_baseline',
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = [
    'Candidate',
    'Circle',
    'Config',
    'FocError',
    'HandState',
    'InputError',
    'MessageError',
    'MonteCarlo',
    'Obstacles',
    'ParameterError',
    'Plant',
    'PlantModel',
    'PredictedCandidate',
    'Prediction',
    'Predictor',
    'RecordingError',
    'SceneError',
    'Solution',
    'Status',
    'load_config',
    'monte_carlo',
    'plot_candidates',
    'register_baseline',
    'register_likelihood_rule',
    'register_plant',
    'register_qp_backend',
    'register_strategy',
    'replay',
    'solve',
    'solve_classes',
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _MODULE_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(_import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, '__version__']
