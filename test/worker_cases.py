# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cases of `test_worker`: equal answers, errors, deadlines, and the end of the process."""

import signal
import subprocess
import sys
import threading
import time
from functools import partial

import numpy as np
import psutil
import pytest

from foc_ros.core.config import Config
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import InputError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline, PredictionTask
from foc_ros.core.types import HandSample
from foc_ros.ros.worker import Worker

STEP_NS = 20_000_000


@pytest.fixture
def begin():
    """Yield a function that begins a worker, which is ended afterwards, and the list of its warnings."""
    begun = []

    def start():
        warnings = []
        begun.append(Worker(warnings.append))
        return begun[-1], warnings

    yield start
    for worker in begun:
        worker.stop()


def make_pipeline():
    pipeline = Pipeline(Config(budget_s=0.0))
    pipeline.set_obstacles('cloud', make_obstacles([[0.1, 0.01], [0.2, -0.02]], 0.02, 0.002), None, 'world')
    pipeline.set_goals(np.array([[0.3, 0.0], [0.25, 0.1]]), 'world')
    return pipeline


def make_task(deadline=NEVER):
    pipeline = make_pipeline()
    pipeline.add_hand_sample(HandSample(0, np.zeros(2), 0.0, 'world'))
    return pipeline.begin(deadline)


def test_its_predictions_are_those_of_this_process_bit_for_bit(begin):
    worker, warnings = begin()
    here, there = make_pipeline(), make_pipeline()
    for step in range(1, 6):
        sample = HandSample(step * STEP_NS, np.array([0.002 * step**2, 0.0]), 0.0, 'world')
        for pipeline in (here, there):
            assert pipeline.add_hand_sample(sample).is_taken
        expected, task = here.predict(), there.begin(NEVER)
        found = there.finish(task, partial(worker.run, task))
        assert [each.label for each in found.candidates] == [each.label for each in expected.candidates]
        for one, other in zip(found.candidates, expected.candidates, strict=True):
            assert one.likelihood == other.likelihood
            assert one.mean.tobytes() == other.mean.tobytes()
            assert one.covariance.tobytes() == other.covariance.tobytes()
            assert not one.mean.flags.writeable
    assert not warnings


def test_an_error_arrives_with_its_message_and_the_place_where_it_occurred(begin, monkeypatch):
    def refuse(_):
        raise InputError('goals', 'a goal', 'none')

    task = make_task()
    monkeypatch.setattr(PredictionTask, 'run', refuse)
    worker, warnings = begin()
    with pytest.raises(InputError, match='goals: expected a goal, got none') as caught:
        worker.run(task)
    assert 'in refuse' in caught.value.__notes__[0]
    assert not warnings


@pytest.mark.parametrize('is_early', [True, False])
def test_a_prediction_that_is_cancelled_ends(begin, monkeypatch, is_early):
    def wait(task):
        while not task.deadline.has_passed:
            time.sleep(0.001)
        return 'ended'

    deadline = Deadline()
    task = make_task(deadline)
    monkeypatch.setattr(PredictionTask, 'run', wait)
    worker, _ = begin()
    if is_early:
        deadline.cancel()
    else:
        threading.Timer(0.1, deadline.cancel).start()
    assert worker.run(task) == 'ended'
    assert deadline.has_passed
    assert worker.run(make_task(Deadline(0.0))) == 'ended'  # a cancelled prediction leaves the next one its own time


def test_without_its_process_predictions_go_on_and_this_is_told_once(begin):
    worker, warnings = begin()
    worker._process.kill()
    for _ in range(2):
        prediction, _ = worker.run(make_task())
        assert prediction.candidates
    (text,) = warnings
    assert text.startswith(f'the process of the predictions ended with exit code -{signal.SIGKILL:d}: the node computes')


def test_it_ends_with_the_process_that_began_it():
    program = (
        'import os, signal\nfrom foc_ros.ros.worker import Worker\n'
        'worker = Worker(print)\nprint(worker._process.pid, flush=True)\nos.kill(os.getpid(), signal.SIGKILL)'
    )
    ended = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True, timeout=60.0, check=False)
    assert ended.returncode == -signal.SIGKILL
    pid = int(ended.stdout)
    until = time.monotonic() + 20.0
    while psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE and time.monotonic() < until:
        time.sleep(0.05)
    assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
