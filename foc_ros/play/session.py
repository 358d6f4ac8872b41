"""A session: what the page asks for, the predictor behind it and the tasks, all in one thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from time import monotonic, time_ns
from typing import Any

import numpy as np

from foc_ros.core.config import Config, replace_values
from foc_ros.core.errors import InputError, RecordingError
from foc_ros.io.bags import TYPESTORE
from foc_ros.io.topics import CLOUD, GOALS, HAND
from foc_ros.ros.messages.decode_poses import decode_stamp
from foc_ros.ros.messages.encode_inputs import encode_hand_pose
from foc_ros.ros.messages.types import RosbagsTypes
from foc_ros.ros.parameters import load_parameter_file

from . import page_messages, scene, tasks
from .after_session import AfterSession
from .page_answers import make_hello, make_task
from .page_clock import PageClock
from .page_messages import HandMessage, Message, TasksMessage
from .prediction_view import Slots, view_candidates
from .predictors import KINDS, NODE, LivePredictor, Receive, State
from .session_recording import SessionRecording
from .session_report import PREDICTION

OWN_VALUES = {'plane': 'xy', 'frame_id': ''}
"""Parameters that the page fixes."""
WRENCH = f'{NODE}/guidance/wrench'
FORCE_PERIOD_S = 0.012
"""Shortest time between two forces that the page receives [s]; guidance updates more often than a screen."""
REMEMBERED_HANDS = 256
Send = Callable[[dict[str, Any]], None]


class Session:
    """Connects one page with one predictor.

    Attributes: predictor.

    Parameters
    ----------
    make_predictor
        Makes the predictor of parameters and a function that takes its outputs in this thread.
    config
        The parameters to begin with.
    data
        The folder for recordings.
    """

    def __init__(self, make_predictor: Callable[[Config, Receive], LivePredictor], config: Config, data: Path) -> None:
        self._standard = replace_values(config, OWN_VALUES)
        self._after = AfterSession(self._say, self._note_fitted)
        self._parameters, self._is_guided = 'standard', config.guidance.enabled
        self._recording = SessionRecording(data, self._note_lost_recording)
        self._given = self._standard
        self.predictor = make_predictor(self._config, self._receive)
        self._types = RosbagsTypes(TYPESTORE)
        self._scene = scene.FIRST_SCENE
        self._page: Send | None = None
        self._clock, self._slots = PageClock(), Slots()
        self._hands: deque[tuple[int, HandMessage]] = deque(maxlen=REMEMBERED_HANDS)
        self._tasks: tasks.Tasks | None = None
        self._force_s, self._touched = 0.0, 0
        self._handlers: dict[type, Callable[[Any], None]] = {
            HandMessage: self._move_hand,
            page_messages.SceneMessage: self._change_scene,
            page_messages.ShuffleMessage: self._shuffle_scene,
            page_messages.GuidanceMessage: self._switch_guidance,
            page_messages.RecordMessage: self._switch_recording,
            TasksMessage: self._begin_tasks,
            page_messages.StopMessage: lambda _: self._end_tasks(),
            page_messages.ParametersMessage: self._choose_parameters,
            page_messages.JobMessage: self._begin_job,
        }

    @property
    def report(self) -> Path | None:
        """The page of the last report, None before the first."""
        return self._after.report

    def open(self, page: Send) -> None:
        """Serve a page from now on, in place of the one before."""
        self._say('replaced')
        self._page, self._clock = page, PageClock()
        page(make_hello(self.predictor.name, self._standard))
        self._say_settings()
        self._say_scene()
        self._say_task()

    def close_page(self, page: Send) -> None:
        """Stop serving a page, unless another one has taken its place."""
        if self._page == page:
            self._page = None

    def close(self) -> None:
        """End recording, jobs and predictor."""
        self._after.cancel()
        self._end_recording()
        self.predictor.stop()

    def take(self, message: Message, page: Send) -> None:
        """Do what a page asks for, unless it was replaced; raises FocError where that is impossible."""
        if self._page == page:
            self._handlers[type(message)](message)

    def tick(self) -> None:
        """Repeat the scene, which grows too old otherwise, and tell the page the state of the predictor; twice a second."""
        self._send_scene()
        state: State = self.predictor.check()
        self._say('status', alive=state.is_alive, text=state.text)

    # the page's wishes

    def _move_hand(self, message: HandMessage) -> None:
        stamp_ns = self._clock.stamp(message.t_ms, time_ns())
        if stamp_ns is None:
            return
        self._hands.append((stamp_ns, message))
        self._recording.add_hand(stamp_ns, message.position)
        self._send(HAND, encode_hand_pose(self._types, stamp_ns, scene.FRAME, (*message.position, 0.0)))
        if self._tasks is not None:
            self._follow_tasks(self._tasks, stamp_ns * 1e-9, message.position)

    def _change_scene(self, message: page_messages.SceneMessage) -> None:
        self._refuse_during_tasks('scene')
        self._set_scene(message.scene)

    def _shuffle_scene(self, message: page_messages.ShuffleMessage) -> None:
        self._refuse_during_tasks('scene')
        self._set_scene(scene.make_random_scene(np.random.default_rng(message.seed), self._scene.goals))
        self._say_scene()

    def _switch_guidance(self, message: page_messages.GuidanceMessage) -> None:
        self._refuse_during_tasks('guidance')
        self._set_guidance(message.is_on)

    def _choose_parameters(self, message: page_messages.ParametersMessage) -> None:
        self._refuse_during_tasks('parameters')
        if message.name == 'mine' and self._after.operator is None:
            raise InputError('parameters', 'standard until parameters were fitted', 'mine')
        self._parameters = message.name
        self._configure()

    def _switch_recording(self, message: page_messages.RecordMessage) -> None:
        self._refuse_during_tasks('recording')
        if message.is_on and not self._recording.is_running:
            self._begin_recording()
        elif not message.is_on:
            self._end_recording()

    def _begin_tasks(self, settings: TasksMessage) -> None:
        self._refuse_during_tasks('tasks')
        self._end_recording()
        self._begin_recording()
        self._tasks = tasks.Tasks(settings, self._scene)
        self._guided_before = self._is_guided
        self._prepare_trial(self._tasks)

    def _refuse_during_tasks(self, name: str) -> None:
        if self._tasks is not None:
            raise InputError(name, 'no change while tasks run', 'a change')

    # tasks

    def _prepare_trial(self, running: tasks.Tasks) -> None:
        if self._scene is not running.trial.scene:
            self._set_scene(running.trial.scene)
            self._say_scene()
        self._set_guidance(running.trial.is_guided)
        self._say_task()

    def _follow_tasks(self, running: tasks.Tasks, t: float, position: scene.Point) -> None:
        trial, scored = running.trial, len(running.scores)
        phase = running.follow(t, position)
        if self._touched < running.touched:
            self._say('touched')
        self._touched = running.touched
        if phase is None:
            return
        if phase is tasks.Phase.REACH:
            self._recording.begin_trial()
        elif len(running.scores) > scored:
            self._recording.end_trial(trial.is_guided)
        if phase is tasks.Phase.OVER:
            self._end_tasks()
        elif phase is tasks.Phase.RETURN:
            self._prepare_trial(running)
        else:
            self._say_task()

    def _end_tasks(self) -> None:
        if self._tasks is None:
            return
        scores = self._tasks.scores
        self._end_recording()
        self._leave_tasks()
        self._say('score', columns=tasks.SCORE_COLUMNS, rows=tasks.tabulate_scores(scores))

    def _leave_tasks(self) -> None:
        """Forget the tasks, and use the guidance from before them, and the parameters that were fitted meanwhile."""
        if self._tasks is not None:
            self._tasks = None
            if self._is_guided != self._guided_before or self._given != self._read_parameters():
                self._is_guided = self._guided_before
                self._configure()
        self._say_task()

    # recordings, and what is made of them

    def _begin_recording(self) -> None:
        messages = {role: _serialize(message) for role, message in self._scene.encode(self._types, time_ns()).items()}
        self._after.begin_session(*self._recording.begin(self._standard, messages))
        self._say_settings()

    def _end_recording(self) -> None:
        if self._recording.is_running:
            self._recording.end()
            self._say_settings()

    def _note_lost_recording(self, error: RecordingError) -> None:
        """End the tasks with the recording that cannot be written."""
        self._leave_tasks()
        self._say('error', text=str(error))
        self._say_settings()

    def _begin_job(self, message: page_messages.JobMessage) -> None:
        if self._recording.is_running:
            raise InputError('job', 'a session that has ended', message.name)
        self._after.begin(message.name)

    def _note_fitted(self, is_used: bool) -> None:
        self._parameters = 'mine' if is_used else 'standard'
        self._configure()

    # the predictor

    @property
    def _config(self) -> Config:
        return replace_values(self._given, {'guidance.enabled': self._is_guided})

    def _read_parameters(self) -> Config:
        if self._parameters == 'mine' and self._after.operator is not None:
            return replace_values(load_parameter_file(self._after.operator), OWN_VALUES)
        return self._standard

    def _configure(self) -> None:
        if self._tasks is None:  # the parameters do not change while tasks run, also where a fit ends meanwhile
            self._given = self._read_parameters()
        self.predictor.configure(self._config)
        self._say_settings()

    def _set_guidance(self, is_on: bool) -> None:
        if is_on != self._is_guided:
            self._is_guided = is_on
            self._configure()

    def _set_scene(self, new: scene.PlayScene) -> None:
        self._scene = new
        self._send_scene()

    def _send_scene(self) -> None:
        messages = self._scene.encode(self._types, time_ns())
        for role in (CLOUD, GOALS):
            self._send(role, messages[role])

    def _send(self, role: str, message: Any) -> None:
        raw = _serialize(message)
        self.predictor.send(role, raw)
        self._recording.add_input(role, raw)

    def _receive(self, topic: str, raw: bytes) -> None:
        """Take an output of the predictor."""
        self._recording.add_output(topic, raw, self._scene)
        if topic == PREDICTION:
            self._receive_prediction(TYPESTORE.deserialize_cdr(raw, KINDS[topic]))
        elif topic == WRENCH:
            wrench: Any = TYPESTORE.deserialize_cdr(raw, KINDS[topic])
            self._receive_force(wrench.wrench.force)

    def _receive_prediction(self, cloud: Any) -> None:
        stamp_ns = decode_stamp(cloud.header)
        hand = next((hand for stamp, hand in reversed(self._hands) if stamp == stamp_ns), None)
        candidates = view_candidates(cloud, self._slots)
        if self._tasks is not None and candidates:
            self._tasks.note_most_likely(stamp_ns * 1e-9, candidates[0]['way'])
        if hand is not None and not self._is_blind:
            self._say('prediction', t=hand.t_ms, event=hand.event_ms, candidates=candidates)

    def _receive_force(self, force: Any) -> None:
        now_s = monotonic()
        if now_s - self._force_s >= FORCE_PERIOD_S or not (force.x or force.y):
            self._force_s = now_s
            self._say('force', force=[round(float(force.x), 4), round(float(force.y), 4)])

    # what the page is told

    @property
    def _is_blind(self) -> bool:
        return self._tasks is not None and self._tasks.settings.is_blinded

    def _say(self, kind: str, **values: Any) -> None:
        if self._page is not None:
            self._page({'type': kind, **values})

    def _say_scene(self) -> None:
        self._say('scene', **self._scene.as_json())

    def _say_settings(self) -> None:
        self._say(
            'settings',
            guided=self._is_guided and not self._is_blind,
            parameters=self._parameters,
            fitted=self._after.operator is not None,
            recording=self._recording.is_running,
            session='' if self._after.folder is None else str(self._after.folder),
        )

    def _say_task(self) -> None:
        if self._page is not None:
            self._page(make_task(self._tasks))


def _serialize(message: Any) -> bytes:
    return bytes(TYPESTORE.serialize_cdr(message, message.__msgtype__))
