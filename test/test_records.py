# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Records have read-only arrays: copies, unless the array is read-only already."""

import pickle

import numpy as np
import pytest

from foc_ros.core.config import Config
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.prediction import Prediction
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState


@pytest.fixture(scope='module')
def prediction() -> Prediction:
    """Predict a reach past one obstacle."""
    hand = HandState(0, np.zeros(6), 1e-6 * np.eye(6))
    return predict(Config(), hand, make_obstacles([[0.15, 0.0]], 0.02, 0.001), np.array([[0.3, 0.0]]), NO_TRACKS)[0]


def test_a_record_from_another_process_is_read_only() -> None:
    kept = pickle.loads(pickle.dumps(make_obstacles([[0.15, 0.0]], 0.02)))
    assert not any(value.flags.writeable for value in vars(kept).values() if isinstance(value, np.ndarray))


def test_all_arrays_of_a_prediction_are_read_only(prediction: Prediction) -> None:
    for outcome in prediction.candidates:
        for record in (outcome.solution, outcome.candidate):
            arrays = [value for value in vars(record).values() if isinstance(value, np.ndarray)]
            assert arrays and not any(array.flags.writeable for array in arrays)
