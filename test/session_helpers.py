# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A session of `foc_ros play` without a server: a page and a predictor that keep what they receive."""

import asyncio
import json
from typing import Any

import numpy as np

from foc_ros.core.config import Config
from foc_ros.play.messages import parse_message
from foc_ros.play.predictor import Predictor, State
from foc_ros.play.scene import FIRST_SCENE, START
from foc_ros.play.session import Session

CIRCLE = {'kind': 'circle', 'x': 0.1, 'y': 0.0, 'radius': 0.02}
BOX = {'kind': 'box', 'x': 0.2, 'y': 0.05, 'size_x': 0.04, 'size_y': 0.02, 'yaw': 0.5}
SCENE = {'type': 'scene', 'obstacles': [CIRCLE, BOX], 'goals': [{'x': 0.3, 'y': 0.0}]}
TASKS = {'type': 'tasks', 'trials': 2, 'seed': 3, 'assistance': 'mixed', 'blinded': False, 'shuffled': False}


def parse(message: object) -> Any:
    return parse_message(json.dumps(message))


class Silent(Predictor):
    def __init__(self, config: Config, receive: Any) -> None:
        super().__init__(config, receive)
        self.sent: list[tuple[str, Any]] = []
        self.configs: list[Config] = []
        self.state = State('well', 'silent')

    def start(self) -> None:
        pass

    def stop(self) -> None:
        pass

    def send(self, role: str, message: Any) -> None:
        self.sent.append((role, message))

    def configure(self, config: Config) -> None:
        self.configs.append(config)

    def check(self) -> State:
        return self.state


class Page:
    def __init__(self, session: Session) -> None:
        self.session, self.received = session, []
        self.t_ms = 0.0
        session.open(self.receive)

    def receive(self, message: dict[str, Any]) -> None:
        self.received.append(json.loads(json.dumps(message, allow_nan=False)))

    def send(self, message: dict[str, Any]) -> None:
        self.session.take(parse(message), self.receive)

    def last(self, kind: str) -> dict[str, Any]:
        return next(each for each in reversed(self.received) if each['type'] == kind)

    def move(self, position: tuple[float, float], count: int = 1) -> None:
        for _ in range(count):
            self.t_ms += 20.0
            if self.t_ms % 500.0 == 0.0:
                self.session.tick()
            self.send({'type': 'hand', 't': self.t_ms, 'x': position[0], 'y': position[1], 'event': self.t_ms})


def reach(page: Page) -> None:
    """Do one trial, straight to the goal at 0.25 m/s."""
    page.move(START, 60)
    assert page.last('task')['phase'] == 'reach'
    goal = FIRST_SCENE.points[page.last('task')['goal']]
    for share in np.linspace(0.0, 1.0, 60):
        page.move((share * goal[0], share * goal[1]))
    page.move(goal, 20)


async def wait_until(condition: Any, seconds: float = 30.0) -> None:
    deadline = asyncio.get_running_loop().time() + seconds
    while not condition():
        assert asyncio.get_running_loop().time() < deadline
        await asyncio.sleep(0.01)
