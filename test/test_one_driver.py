# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One driver: the library, a replay, the node's intake and the page predict the same, bit for bit, and all of them learn."""

import pickle
from threading import Event

import numpy as np
import pytest
from bag_helpers import FRAME, START_NS, TYPES, write_bag

import foc_ros
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config, replace_values
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import BagReader, Item
from foc_ros.io.topics import CLOUD, GOALS, HAND
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles

CONFIG = replace_values(
    Config(), {'rate_hz': 1000.0, 'budget_s': 0.0, 'foc.steps': 10, 'homotopy.max_candidates': 2, 'experience.learning': 'online'}
)
PERIOD_S, SLOW_S, JUMP = 0.1, 2.2, 12
SCENE = [(0.15, 0.01, 0.0, 0.03, 0.002, 7), (0.22, -0.04, 0.0, 0.02, 0.001, 9)]
GOAL = [(0.3, 0.0, 0.0), (0.3, 0.08, 0.0)]


def positions():
    """Return stamps and positions of two slow reaches with a rest at both ends, and a jump of the tracker on the way."""
    found = []
    for number in range(2):
        for step in range(round((SLOW_S + 1.2) / PERIOD_S)):
            s = float(np.clip((step * PERIOD_S - 0.5) / SLOW_S, 0.0, 1.0))
            s = 10 * s**3 - 15 * s**4 + 6 * s**5
            s = s if number == 0 else 1.0 - s
            stamp_ns = START_NS + round((number * (SLOW_S + 1.2) + step * PERIOD_S) * NANOSECONDS)
            place = np.array([0.3 * s, 0.05 * np.sin(np.pi * s), 0.1])
            found.append((stamp_ns, place + (1.0 if (number, step) == (0, JUMP) else 0.0)))
    return found


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    items = [
        ('/obstacles', START_NS, encode_obstacles(TYPES, START_NS, FRAME, SCENE)),
        ('/goals', START_NS, encode_goals(TYPES, START_NS, FRAME, np.array(GOAL))),
        *(('/hand_pose', stamp_ns, encode_hand_pose(TYPES, stamp_ns, FRAME, place)) for stamp_ns, place in positions()),
    ]
    return write_bag(tmp_path_factory.mktemp('one') / 'bag', items)


@pytest.fixture(scope='module')
def replayed(bag):
    replay = Replay(replace_values(CONFIG, {'scene.timeout_s': 0.0}))
    with BagReader(bag) as reader:
        made = [each.prediction for each in replay.steps(reader) if each.prediction is not None]
    return made, replay.pipeline


def strip(prediction):
    """Return all of a prediction but wall times, and the name of its frame, as bytes."""
    solutions = [{**vars(each.solution), 'solve_s': 0.0} for each in prediction.candidates]
    others = [(each.label, each.likelihood, each.cost, each.age_s, each.way) for each in prediction.candidates]
    whole = prediction.stamp_ns, prediction.most_likely, prediction.unknown, prediction.notes, others
    return pickle.dumps((whole, [sorted((name, repr(value)) for name, value in each.items()) for each in solutions])) + b''.join(
        each.mean.tobytes() + each.covariance.tobytes() for each in prediction.candidates
    )


def test_all_samples_but_the_jump_are_predicted_and_the_operator_is_learnt(replayed):
    made, pipeline = replayed
    assert len(made) == len(positions()) - 1
    learnt = pipeline.learnt
    assert learnt.pace.movements == 1 and learnt.dispersion.errors > 0 and len(learnt.movements.learnt) >= 1
    assert pipeline.adapted_config.duration.fitts_b_s > 1.1 * CONFIG.duration.fitts_b_s


def test_the_library_predicts_what_a_replay_does(bag, replayed):
    with BagReader(bag) as reader:
        scene = next(each.scene for each in Replay(CONFIG).steps(reader) if each.prediction is not None)
    predictor = foc_ros.Predictor(replace_values(CONFIG, {'frame_id': FRAME}))
    assert scene.goals is not None
    predictor.set_goals(scene.goals)
    predictor.set_obstacles(scene.sources['cloud'].obstacles)
    made, refused = list[Prediction](), list[str]()
    for stamp_ns, place in positions():
        try:
            made.append(predictor.update(stamp_ns / NANOSECONDS, place[:2]))
        except foc_ros.InputError as error:
            refused.append(error.field)
    assert refused == ['position']
    assert [strip(each) for each in made] == [strip(each) for each in replayed[0]]
    assert predictor.adapted_config.duration == replayed[1].adapted_config.duration


def test_the_page_predicts_what_a_replay_does(bag, replayed):
    from foc_ros.play.predictor import Predictor
    from foc_ros.play.scene import View, view_prediction

    received, arrived = list[Prediction](), Event()

    def receive(outcome):
        if isinstance(outcome, View):
            received.append(outcome.prediction)
            arrived.set()

    page = Predictor(replace_values(CONFIG, {'scene.timeout_s': 0.0}), receive)
    page.start()
    try:
        with BagReader(bag) as reader:
            items: list[Item] = list(reader)
        for role in (CLOUD, GOALS, HAND):
            for number, item in enumerate(each for each in items if each.role == role):
                count = len(received)
                page.send(role, item.message)
                while role == HAND and len(received) == count and arrived.wait(0.3 if number == JUMP else 20.0):
                    arrived.clear()
    finally:
        page.stop()
    assert [strip(each) for each in received] == [strip(view_prediction(each).prediction) for each in replayed[0]]
