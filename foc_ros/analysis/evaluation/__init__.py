# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Evaluation: recordings and predictions enter; scores beside simple baselines leave.

A baseline is added by :func:`register_baseline`.
"""

from foc_ros.analysis.evaluation.baselines import Baseline, Forecast, register_baseline
from foc_ros.analysis.evaluation.observations import Observation, ObservedRecording, Question

__all__ = ['Baseline', 'Forecast', 'Observation', 'ObservedRecording', 'Question', 'register_baseline']
