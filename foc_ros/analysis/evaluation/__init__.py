"""Evaluation: recordings and predictions enter; scores beside simple baselines leave.

A baseline is added by :func:`register_baseline`.
"""

from .baselines import Baseline, register_baseline
from .forecasts import Forecast
from .observations import Observation, ObservedRecording
from .questions import Question

__all__ = ['Baseline', 'Forecast', 'Observation', 'ObservedRecording', 'Question', 'register_baseline']
