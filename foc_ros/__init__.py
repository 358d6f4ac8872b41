# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""foc_ros predicts where an operator's hand is going among obstacles, with its uncertainty.

This module is the public Python API. Lengths are in metres, times in seconds, positions in the task plane. Names are imported
when they are first used, so that `import foc_ros` alone is fast.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING, Any

__version__ = '0.2.0'

if TYPE_CHECKING:
    from foc_ros.analysis.evaluation import register_baseline as register_baseline
    from foc_ros.api import *  # noqa: F403
    from foc_ros.core.config import Config as Config
    from foc_ros.core.config import CovarianceConfig as CovarianceConfig
    from foc_ros.core.config import DurationConfig as DurationConfig
    from foc_ros.core.config import EstimatorConfig as EstimatorConfig
    from foc_ros.core.config import ExperienceConfig as ExperienceConfig
    from foc_ros.core.config import FocConfig as FocConfig
    from foc_ros.core.config import FramesConfig as FramesConfig
    from foc_ros.core.config import GuidanceConfig as GuidanceConfig
    from foc_ros.core.config import HomotopyConfig as HomotopyConfig
    from foc_ros.core.config import LikelihoodConfig as LikelihoodConfig
    from foc_ros.core.config import SceneConfig as SceneConfig
    from foc_ros.core.errors import FocError as FocError
    from foc_ros.core.errors import FocWarning as FocWarning
    from foc_ros.core.errors import InputError as InputError
    from foc_ros.core.errors import MessageError as MessageError
    from foc_ros.core.errors import ParameterError as ParameterError
    from foc_ros.core.errors import RecordingError as RecordingError
    from foc_ros.core.errors import SceneError as SceneError
    from foc_ros.core.guidance.guide import GuidanceOutput as GuidanceOutput
    from foc_ros.core.guidance.guide import GuidanceStatus as GuidanceStatus
    from foc_ros.core.obstacle_table import Obstacles as Obstacles
    from foc_ros.core.obstacles.shapes import Box as Box
    from foc_ros.core.obstacles.shapes import Capsule as Capsule
    from foc_ros.core.obstacles.shapes import Circle as Circle
    from foc_ros.core.obstacles.shapes import Hull as Hull
    from foc_ros.core.ocp.monte_carlo import MonteCarlo as MonteCarlo
    from foc_ros.core.ocp.strategies import StrategyResult as StrategyResult
    from foc_ros.core.plant.models import PlantModel as PlantModel
    from foc_ros.core.plant.plants import Plant as Plant
    from foc_ros.core.prediction import PredictedCandidate as PredictedCandidate
    from foc_ros.core.prediction import PredictedGoal as PredictedGoal
    from foc_ros.core.solution import Candidate as Candidate
    from foc_ros.core.solution import Goal as Goal
    from foc_ros.core.solution import Status as Status
    from foc_ros.core.types import HandState as HandState
    from foc_ros.extending import *  # noqa: F403
    from foc_ros.prediction import Prediction as Prediction
    from foc_ros.solving import *  # noqa: F403

_MODULES = {
    'api': 'Guidance Predictor load_config replay',
    'prediction': 'Prediction',
    'extending': ('compute_eta get_strategy register_likelihood_rule register_plant register_qp_backend register_strategy'),
    'solving': 'Solution monte_carlo plot_candidates solve solve_classes',
    'analysis.evaluation': 'register_baseline',
    'core.config': (
        'Config CovarianceConfig DurationConfig EstimatorConfig ExperienceConfig FocConfig FramesConfig GuidanceConfig '
        'HomotopyConfig LikelihoodConfig SceneConfig'
    ),
    'core.plant.models': 'PlantModel',
    'core.plant.plants': 'Plant',
    'core.errors': 'FocError FocWarning InputError MessageError ParameterError RecordingError SceneError',
    'core.guidance.guide': 'GuidanceOutput GuidanceStatus',
    'core.obstacle_table': 'Obstacles',
    'core.obstacles.shapes': 'Box Capsule Circle Hull',
    'core.ocp.monte_carlo': 'MonteCarlo',
    'core.ocp.strategies': 'StrategyResult',
    'core.prediction': 'PredictedCandidate PredictedGoal',
    'core.solution': 'Candidate Goal Status',
    'core.types': 'HandState',
}
_MODULE_OF = {name: f'{__name__}.{module}' for module, names in _MODULES.items() for name in names.split()}

__all__ = list(_MODULE_OF)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _MODULE_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(_import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, '__version__']
