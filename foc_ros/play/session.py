# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
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
from foc_ros.reporting.views import NOTED, Slots
from foc_ros.ros.messages.encode_inputs import encode_hand_pose
from foc_ros.ros.messages.types import RosbagsTypes
from foc_ros.ros.parameters import load_parameter_file

from . import messages, scene, tasks
from .jobs import Jobs
from .predictor import Predictor, Receive, State
from .recording import Recording

OWN_VALUES = {'plane': 'xy', 'frame_id': ''}
"""Parameters that the page fixes."""
Send = Callable[[dict[str, Any]], None]


class Session:
    """Connects one page with one predictor, an attribute.

    make_predictor: makes it of parameters and a function that takes its outcomes in this thread; config: to begin with; data: the
    folder for recordings.
    """

    def __init__(self, make_predictor: Callable[[Config, Receive], Predictor], config: Config, data: Path) -> None:
        self._standard = self._given = replace_values(config, OWN_VALUES)
        self._data, self._jobs = data, Jobs(self._say, self._note_fitted)
        self._parameters, self._is_guided = 'standard', config.guidance.enabled
        self._recording: Recording | None = None
        self.predictor = make_predictor(self._config, self._receive)
        self._types = RosbagsTypes(TYPESTORE)
        self._scene: scene.PlayScene = scene.FIRST_SCENE
        self._page: Send | None = None
        self._kept: dict[str, dict[str, Any]] = {}
        self._told: dict[str, dict[str, Any]] = {}
        self._clock, self._slots = messages.PageClock(), Slots()
        self._hands: deque[tuple[int, messages.HandMessage]] = deque(maxlen=256)
        self._tasks: tasks.Tasks | None = None
        self._guided_before = self._is_guided
        self._force_s, self._level = 0.0, ''

    @property
    def report(self) -> Path | None:
        """The page of the last report, None before the first."""
        return self._jobs.report

    def open(self, page: Send) -> None:
        """Serve a page from now on, in place of the one before; it is told the state of everything."""
        self._say('replaced')
        self._page, self._clock = page, messages.PageClock()
        limits = {'obstacles': scene.MOST_OBSTACLES, 'goals': scene.MOST_GOALS}
        self._say(
            'hello',
            bounds=scene.BOUNDS,
            start=scene.START,
            hand=self._hands[-1][1].position if self._hands else scene.START,
            target_radius=scene.TARGET_RADIUS,
            radius_stddev=scene.RADIUS_STDDEV,
            first_scene=scene.FIRST_SCENE.model_dump(),
            most=limits,
            data=str(self._data),
            max_speed=self._standard.guidance.max_speed,
            # with a spring that is as stiff as guidance at most, the loop of cursor and guidance is stable at any delay
            coupling=max(self._standard.guidance.k_max, 1.0),
        )
        self._send_scene()  # so that the first status does not miss obstacles
        self._say_scene()
        self._told.clear()
        self._tell_state()
        for message in list(self._kept.values()):
            page(message | {'seconds': self._jobs.seconds} if message.get('state') == 'running' else message)

    def close_page(self, page: Send) -> None:
        """Stop serving a page, unless another one has taken its place."""
        if self._page == page:
            self._page = None

    def close(self) -> None:
        """End recording, jobs and predictor."""
        self._jobs.cancel()
        self._end_recording()
        self.predictor.stop()

    def take(self, message: messages.Message, page: Send) -> None:
        """Do what a page asks for, unless it was replaced; raises FocError where that is impossible."""
        if self._page != page:
            return
        kind = message.type
        if self._tasks is not None and kind not in ('hand', 'stop', 'job', 'cancel'):
            changed = {'shuffle': 'scene', 'record': 'recording'}.get(kind, kind)
            raise InputError(changed, 'no change while tasks run', 'a change')
        match message:
            case messages.HandMessage():
                self._move_hand(message)
            case messages.SceneMessage():
                self._set_scene(scene.PlayScene(obstacles=message.obstacles, goals=message.goals))
            case messages.ShuffleMessage():
                self._set_scene(scene.make_random_scene(np.random.default_rng(message.seed), self._scene.goals))
                self._say_scene()
            case messages.SwitchMessage(type='guidance'):
                self._set_guidance(message.on)
            case messages.SwitchMessage(on=False):
                self._end_recording()
            case messages.SwitchMessage():
                if self._recording is None:
                    self._begin_recording()
            case messages.TasksMessage():
                self._begin_tasks(message)
            case messages.NameMessage():
                if message.name == 'mine' and self._jobs.operator is None:
                    raise InputError('parameters', 'standard until parameters were fitted', 'mine')
                self._parameters = message.name
                self._configure()
            case messages.JobMessage():
                if self._recording is not None:
                    raise InputError('job', 'a session that has ended', message.name)
                self._jobs.begin(message.name)
            case messages.PlainMessage(type='stop'):
                self._end_tasks()
            case messages.PlainMessage():
                self._jobs.cancel()
        self._tell_state()

    def tick(self) -> None:
        """Repeat the scene, which grows too old otherwise, and tell the page the state of the predictor; twice a second."""
        self._send_scene()
        self._tell_status(self.predictor.check())

    def _move_hand(self, message: messages.HandMessage) -> None:
        stamp_ns = self._clock.stamp(message.t, time_ns())
        if stamp_ns is None:
            return
        self._hands.append((stamp_ns, message))
        if self._recording is not None:
            self._recording.add_hand(stamp_ns, message.position)
        self._send(HAND, encode_hand_pose(self._types, stamp_ns, scene.FRAME, (*message.position, 0.0)))
        if self._tasks is not None:
            self._follow_tasks(self._tasks, stamp_ns * 1e-9, message.position)

    # tasks

    def _begin_tasks(self, settings: messages.TasksMessage) -> None:
        self._end_recording()
        self._begin_recording()
        self._tasks, self._guided_before = tasks.Tasks(settings, self._scene), self._is_guided
        self._prepare_trial(self._tasks)

    def _prepare_trial(self, running: tasks.Tasks) -> None:
        if self._scene is not running.trial.scene:
            self._set_scene(running.trial.scene)
            self._say_scene()
        self._set_guidance(running.trial.is_guided)

    def _follow_tasks(self, running: tasks.Tasks, t: float, position: scene.Point) -> None:
        trial, scored, touched = running.trial, len(running.scores), running.touched
        phase = running.follow(t, position)
        if running.touched > touched:
            self._say('touched')
        if phase is None:
            return
        if phase is tasks.Phase.REACH:
            self._record(lambda recording: recording.begin_trial())
        elif len(running.scores) > scored:
            self._record(lambda recording: recording.end_trial(trial.is_guided))
        if phase is tasks.Phase.OVER:
            self._end_tasks()
        elif phase is tasks.Phase.RETURN and self._tasks is not None:
            self._prepare_trial(running)

    def _end_tasks(self) -> None:
        if self._tasks is None:
            return
        rows = tasks.tabulate_scores(self._tasks.scores)
        if self._recording is not None and rows:
            self._recording.scores = ('Score', tasks.SCORE_COLUMNS, rows)
        self._end_recording()
        self._leave_tasks()
        self._say('score', columns=tasks.SCORE_COLUMNS, rows=rows)

    def _leave_tasks(self) -> None:
        """Forget the tasks, and use the guidance from before them, and the parameters that were fitted meanwhile."""
        if self._tasks is not None:
            self._tasks = None
            if self._is_guided != self._guided_before or self._given != self._read_parameters():
                self._is_guided = self._guided_before
                self._configure()

    # recordings

    def _begin_recording(self) -> None:
        self._recording = Recording(self._data, self._standard, self._scene.encode(self._types, time_ns()), self._types)
        self._jobs.recording = self._recording
        self._kept.pop('score', None)  # that of the session before

    def _end_recording(self) -> None:
        if self._recording is not None:
            recording, self._recording = self._recording, None
            recording.close()

    def _record(self, add: Callable[[Recording], None]) -> None:
        """Add to the recording, if there is one; one that cannot be written ends, and the tasks with it."""
        if self._recording is None:
            return
        try:
            add(self._recording)
        except RecordingError as error:
            recording, self._recording = self._recording, None
            recording.discard(error)
            self._leave_tasks()
            self._say('error', text=str(error))
            self._tell_state()

    # the predictor

    @property
    def _config(self) -> Config:
        return replace_values(self._given, {'guidance.enabled': self._is_guided})

    def _read_parameters(self) -> Config:
        if self._parameters == 'mine' and self._jobs.operator is not None:
            return replace_values(load_parameter_file(self._jobs.operator), OWN_VALUES)
        return self._standard

    def _note_fitted(self, is_used: bool) -> None:
        self._parameters = 'mine' if is_used else 'standard'
        self._configure()

    def _configure(self) -> None:
        if self._tasks is None:  # the parameters do not change while tasks run, also where a fit ends meanwhile
            self._given = self._read_parameters()
        self.predictor.configure(self._config)

    def _set_guidance(self, is_on: bool) -> None:
        if is_on != self._is_guided:
            self._is_guided = is_on
            self._configure()

    def _set_scene(self, new: scene.PlayScene) -> None:
        self._scene = new
        self._send_scene()

    def _send_scene(self) -> None:
        encoded = self._scene.encode(self._types, time_ns())
        for role in (CLOUD, GOALS):
            self._send(role, encoded[role])

    def _send(self, role: str, message: Any) -> None:
        self.predictor.send(role, message)
        self._record(lambda recording: recording.add_input(role, message))

    def _receive(self, outcome: Any) -> None:
        """Take a prediction, or guidance and where it holds."""
        if isinstance(outcome, scene.View):
            self._receive_prediction(outcome)
        else:
            self._record(lambda recording: recording.add_guidance(*outcome))
            force, now_s = outcome[0].force, monotonic()
            if now_s - self._force_s >= 0.012 or not force.any():  # guidance updates more often than a screen
                self._force_s = now_s
                self._say('force', force=force.round(4).tolist())

    def _receive_prediction(self, view: scene.View) -> None:
        prediction, stamp_ns = view.prediction, view.prediction.stamp_ns
        hand = next((hand for stamp, hand in reversed(self._hands) if stamp == stamp_ns), None)
        if self._tasks is not None and prediction.most_likely is not None:
            self._tasks.note_most_likely(stamp_ns * 1e-9, prediction.candidates[0].way)
        if hand is not None and not self._is_blind:
            ways = [each['way'] for each in view.candidates if (each['likelihood'] or 0.0) >= NOTED]
            slots = dict(zip(ways, self._slots.assign(ways), strict=True))
            candidates = [each | {'slot': slots.get(each['way'])} for each in view.candidates]
            shares = {'unknown': round(prediction.unknown, 4), 'other': round(prediction.other, 4)}
            self._say('prediction', t=hand.t, event=hand.event, candidates=candidates, **shares)
            state = self.predictor.check()
            if state.level != 'well' == self._level:  # at once: the page must not be green meanwhile
                self._tell_status(state)
        self._record(lambda recording: recording.add_prediction(prediction))  # afterwards: the page does not wait for it

    # what the page is told

    @property
    def _is_blind(self) -> bool:
        return self._tasks is not None and self._tasks.settings.blinded

    def _say(self, kind: str, **values: Any) -> None:
        message = {'type': kind, **values}
        if kind in ('score', 'job', 'result'):  # repeated to a page that is loaded again
            self._kept[kind] = message
        if self._page is not None:
            self._page(message)
        if kind == 'job':
            self._tell_state()

    def _tell_status(self, state: State) -> None:
        self._level = state.level
        self._say('status', level=state.level, text=state.text)

    def _say_scene(self) -> None:
        self._say('scene', **self._scene.model_dump())

    def _tell_state(self) -> None:
        """Tell settings and task where they have changed."""
        for kind, values in (('settings', self._list_settings()), ('task', self._describe_task())):
            if self._told.get(kind) != values:
                self._told[kind] = values
                self._say(kind, **values)

    def _list_settings(self) -> dict[str, Any]:
        recording, report = self._jobs.recording, self._jobs.report
        return {
            'guided': self._is_guided and not self._is_blind,
            'parameters': self._parameters,
            'fitted': self._jobs.operator is not None,
            'recording': self._recording is not None,
            'session': '' if recording is None else str(recording.folder),
            'unguided': recording is not None and recording.has_unguided,
            'report': recording is not None and report is not None and report.is_relative_to(recording.folder),
        }

    def _describe_task(self) -> dict[str, Any]:
        if self._tasks is None:
            return {'phase': 'none'}
        running = self._tasks
        goal = running.trial.goal if running.phase is tasks.Phase.REACH else None
        place = {'trial': running.number + 1, 'trials': len(running.trials), 'goal': goal}
        return {'phase': running.phase.value, **place, 'blinded': running.settings.blinded}
