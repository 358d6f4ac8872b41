# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline that node and replay share: messages enter, ordered by stamp; at most one prediction per hand sample leaves.

The pipeline uses the stamps of messages only and reads no clock, so that equal messages give equal predictions, live or replayed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import shorten

from .classes.library import Demonstration
from .config import ONLINE, Config
from .deadline import NEVER, Deadline
from .errors import FocError
from .hand.kalman import FilterState, describe_jump, update
from .learning.learnt import Knowledge, Learnt
from .learning.recordings import make_library
from .obstacle_table import Obstacles
from .predict import predict
from .prediction import Prediction
from .scene import ObstacleSource, Scene
from .support import Rejections
from .tracks import NO_TRACKS, Tracks
from .types import NANOSECONDS, Array, HandSample, HandState, SampleStatus

__all__ = ['Compute', 'Pipeline', 'PredictionTask', 'SampleStatus']


@dataclass(frozen=True, eq=False)
class PredictionTask:
    """One prediction that is to be made: all arguments of `predict`, none of which changes, and its deadline."""

    config: Config
    hand: HandState
    obstacles: Obstacles
    goals: Array
    tracks: Tracks
    knowledge: Knowledge
    deadline: Deadline
    goal_heights: Array | None

    def run(self) -> tuple[Prediction, Tracks]:
        """Compute the prediction and the classes that it follows; this may happen in another thread."""
        scene = self.hand, self.obstacles, self.goals
        return predict(self.config, *scene, self.tracks, self.knowledge, self.deadline, self.goal_heights)


Compute = Callable[[PredictionTask], tuple[Prediction, Tracks]]
"""Returns or raises what a task's `run` does, possibly computed in another process."""


class Pipeline:
    """Follow the hand, keep the scene, and predict when a new hand sample is due.

    library: demonstrated paths; is_timed: whether `rate_hz` and `scene.timeout_s` apply; without them every hand sample is due,
    and obstacles are never too old. Attributes: config; given, this library; hand_state, None before the first hand sample;
    scene, obstacles and goals; is_engaged, whether predictions are made; frame_id, the working frame, None until the parameter or
    the first hand sample fixes it; learnt, what was learnt so far of the operator and the scene; library_doubt, why no path
    of the library could count so far, empty once one could, None before the first prediction.
    """

    def __init__(self, config: Config, library: Sequence[Demonstration] = (), *, is_timed: bool = True) -> None:
        self.config = config
        self._is_timed = is_timed
        self.given = tuple(library)
        self.hand_state: FilterState | None = None
        self.scene = Scene()
        self.is_engaged = True
        self.learnt, self._library = Learnt(), make_library(self.given)
        self.library_doubt: str | None = None
        self.frame_id = config.frame_id.lstrip('/') or None
        self._rejections = Rejections()
        self._tracks = NO_TRACKS
        self._is_new = False
        self._was_tried = False
        self._predicted_ns: int | None = None
        self._late_ns = 0  # how much later than due the last prediction was
        self._task: PredictionTask | None = None

    @property
    def adapted_config(self) -> Config:
        """The parameters with which the next prediction is made: those given, adapted to the operator."""
        return self.learnt.adapt(self.config)

    @property
    def counts(self) -> dict[str, int]:
        """Number of rejections, drops, restarts and failures by kind."""
        return dict(self._rejections.counts)

    @property
    def refused(self) -> int:
        """Number of rejections of all kinds."""
        return self._rejections.refused

    @property
    def last_refusal(self) -> str | None:
        """The text of the last rejection."""
        return self._rejections.last

    @property
    def is_due(self) -> bool:
        """Whether there is a new hand sample, and its stamp is due (or any, after a restart).

        Stamps are due every 1 / rate_hz. A sample that comes later than that, by up to half of this period, does not postpone the
        ones after it, so that `rate_hz` is reached if there are at least two samples in a period.
        """
        if self.hand_state is None or not self._is_new or not self.is_engaged:
            return False
        return self._due_ns is None or self.hand_state.stamp_ns >= self._due_ns

    @property
    def until_due_s(self) -> float:
        """Time from the stamp of the newest hand sample until a prediction is due [s]; 0 or less if one is due now."""
        if self.hand_state is None or self._due_ns is None:
            return 0.0
        return (self._due_ns - self.hand_state.stamp_ns) / NANOSECONDS

    @property
    def _due_ns(self) -> int | None:
        """Stamp from which on the next prediction is due; None if any stamp is."""
        if self._predicted_ns is None or not self._is_timed:
            return None
        period_ns = int(NANOSECONDS / self.config.rate_hz)
        return self._predicted_ns + period_ns - min(self._late_ns, period_ns // 2)

    def add_hand_sample(self, sample: HandSample) -> SampleStatus:
        """Take a hand sample. The first one fixes the working frame if the parameter does not."""
        if not self._rejections.accept_frame('hand_wrong_frame', 'hand_pose', sample.frame_id, self.frame_id):
            return SampleStatus.WRONG_FRAME
        before, is_superseded = self.hand_state, self.is_due and not self._was_tried and self._find_not_ready_reason() is None
        updated = update(before, sample, self.config.estimator)
        status = updated.status
        if not status.is_taken:
            assert before is not None
            if status is SampleStatus.JUMPED:
                error = describe_jump('hand_pose', before, sample, self.config.estimator)
                self._rejections.reject('hand_jumped', str(error))
            else:
                self._rejections.reject_stamp(f'hand_{status}', 'hand_pose', sample.stamp_ns, before.stamp_ns)
            self.hand_state = updated.state
            return status
        if self.frame_id is None:
            self._fix_frame(sample.frame_id)
        self.hand_state, self._is_new, self._was_tried = updated.state, True, False
        if is_superseded:
            self._rejections.count('hand_superseded')
        if status.is_restart:
            self._rejections.count(f'hand_{status}')
            self._forget_predictions()
        if not self.is_engaged:
            self._rejections.reject('hand_disengaged', 'hand_pose: disengaged, nothing is predicted')
            return SampleStatus.DISENGAGED
        self._learn(self.learnt.follow(self.hand_state, self.scene, self.config, is_restart=status.is_restart))
        return status

    def set_obstacles(self, source: str, obstacles: Obstacles, stamp_ns: int | None, frame_id: str) -> SampleStatus:
        """Replace the obstacles of one source ('cloud' or 'markers').

        Obstacles without a stamp (None) have no age and are not moved on. A table that is older than the present one of the
        same source, by `estimator.gap_s` at most, is late and does not replace it.
        """
        if not self._rejections.accept_frame('obstacles_wrong_frame', source, frame_id, self.frame_id):
            return SampleStatus.WRONG_FRAME
        present = self.scene.sources.get(source)
        newest_ns = None if present is None else present.stamp_ns
        longest_ns = self.config.estimator.gap_s * NANOSECONDS
        if stamp_ns is not None and newest_ns is not None and 0 < newest_ns - stamp_ns <= longest_ns:
            self._rejections.reject_stamp('obstacles_late', source, stamp_ns, newest_ns)
            return SampleStatus.LATE
        self.scene = self.scene.with_source(source, ObstacleSource(obstacles, stamp_ns, frame_id))
        return SampleStatus.ACCEPTED

    def set_goals(
        self, goals: Array, frame_id: str, heights: Array | None = None, objects: Sequence[str | None] = ()
    ) -> SampleStatus:
        """Replace all goals, (g, 2) [m]; an empty array removes them.

        heights (g,): where they are known [m]; objects: the id of the obstacle that each goal is, None where none is named.
        """
        if not self._rejections.accept_frame('goals_wrong_frame', 'goals', frame_id, self.frame_id):
            return SampleStatus.WRONG_FRAME
        self.scene = self.scene.with_goals(goals, frame_id, heights, objects)
        return SampleStatus.ACCEPTED

    def predict(self, deadline: Deadline = NEVER) -> Prediction | None:
        """Predict from the newest hand sample; if that is impossible, count it, explain it in `last_refusal`, return None."""
        task = self.begin(deadline)
        return None if task is None else self.finish(task, task.run)

    def begin(self, deadline: Deadline) -> PredictionTask | None:
        """Return the prediction from the newest hand sample as a task for `finish`; None, with a count, if it is impossible.

        deadline: not shared with other tasks, because it ends when the task is abandoned. A task that is begun before the end of
        the last one replaces it.
        """
        self._was_tried = True
        reason = self._find_not_ready_reason()
        if reason is None and not self.is_due:
            reason = ('not_due', 'no hand pose since the last prediction whose stamp is due by rate_hz')
        if reason is not None:
            self._rejections.reject(f'predict_{reason[0]}', reason[1])
            return None
        assert self.hand_state is not None
        assert self.scene.goals is not None
        stamp_ns, due_ns = self.hand_state.stamp_ns, self._due_ns
        self._late_ns = 0 if due_ns is None else stamp_ns - due_ns
        self._is_new, self._predicted_ns = False, stamp_ns
        obstacles = self.scene.obstacles(self.hand_state.stamp_ns)
        if self.library_doubt != '':
            self.library_doubt = _describe_unused(self.given, self.hand_state.frame_id, obstacles)
        scene = self.hand_state, obstacles, self.scene.goals
        knowledge = Knowledge(self._library, self.learnt.planning_spread, self.scene.goal_objects, self.learnt.habits)
        tracks, heights = self._tracks, self.scene.goal_heights
        self._task = PredictionTask(self.adapted_config, *scene, tracks, knowledge, deadline, heights)
        return self._task

    def finish(self, task: PredictionTask, compute: Callable[[], tuple[Prediction, Tracks]]) -> Prediction | None:
        """Return the prediction of a task, and remember it; None, with a count, if it failed or was abandoned meanwhile.

        compute: `task.run`, or a function that returns or raises what it returned or raised in another thread.
        """
        if task is not self._task:
            self._rejections.count('predict_abandoned')
            return None
        self._task = None
        try:
            prediction, self._tracks = compute()
        except FocError as error:
            self._rejections.reject('predict_failed', str(error))
            return None
        self.learnt = self.learnt.add(prediction, task.config.covariance)
        for candidate in prediction.candidates:
            if not candidate.has_likelihood:
                self._rejections.count(f'candidate_{candidate.status.value}')
        if not prediction.candidates_with_likelihood:
            self._rejections.count('predict_nothing_solved')
        return prediction

    def not_ready_reason(self) -> str | None:
        """Return why nothing can be predicted now, with numbers; None if it can."""
        reason = self._find_not_ready_reason()
        return None if reason is None else reason[1]

    def set_engaged(self, on: bool) -> None:
        """Engage or disengage: while disengaged the hand is followed, but nothing is predicted."""
        if on == self.is_engaged:
            return
        self.is_engaged, self._is_new = on, False
        self._forget_predictions()
        self._learn(self.learnt.interrupt())

    def remove_source(self, source: str) -> None:
        """Forget the obstacles of one source, as if none of its messages had been received."""
        self.scene = self.scene.without_source(source)

    def forget_scene(self) -> None:
        """Forget obstacles, goals and the working frame, unless the parameter fixes it."""
        self.scene, self.frame_id = Scene(), self.config.frame_id.lstrip('/') or None

    def reset(self) -> None:
        """Forget the movement and the operator; keep the scene, the working frame and the counts."""
        self.hand_state, self._is_new = None, False
        self._learn(Learnt())
        self._forget_predictions()

    def reconfigure(self, config: Config) -> None:
        """Replace the parameters. Movement and scene are kept unless the plane or the working frame changes.

        A prediction that is being computed is abandoned, and the newest hand sample is due instead.
        """
        if config.plane != self.config.plane:
            self.reset()
            self.scene = Scene()
        frame_id = config.frame_id.lstrip('/')
        if frame_id and frame_id != self.frame_id:
            self.reset()
            self._fix_frame(frame_id)
        self._learn(self.learnt.reconfigure(self.config, config))
        self.config = config
        if self._task is not None:
            self._abandon_task()
            self._is_new, self._predicted_ns = True, None
        self._tracks = self._tracks.without_solutions()

    def _learn(self, learnt: Learnt) -> None:
        """Replace what was learnt, and the library if it has other recordings now."""
        recordings = learnt.movements.learnt
        if recordings is not self.learnt.movements.learnt:
            is_given = self.config.experience.learning == ONLINE
            self._library = make_library((*self.given, *recordings)) if is_given else make_library(self.given, recordings)
        self.learnt = learnt

    def _find_not_ready_reason(self) -> tuple[str, str] | None:
        """Return why the pipeline cannot predict, as (kind, message), judged by stamps; the node also judges by its clocks."""
        if not self.is_engaged:
            return 'disengaged', 'disengaged'
        if self.hand_state is None:
            return 'no_hand', 'no hand pose yet'
        return self.scene.not_ready_reason(self.hand_state.stamp_ns, self.config.scene.timeout_s if self._is_timed else 0.0)

    def _forget_predictions(self) -> None:
        self._abandon_task()
        self._tracks, self._predicted_ns = self._tracks.forget(), None

    def _abandon_task(self) -> None:
        """Make sure that a prediction that is being computed is neither returned nor remembered, and end it soon."""
        if self._task is not None:
            self._task.deadline.cancel()
            self._task = None

    def _fix_frame(self, frame_id: str) -> None:
        """Fix the working frame and drop what was received in another one."""
        before, self.frame_id, self.scene = self.scene, frame_id, Scene()
        for name, source in before.sources.items():
            self.set_obstacles(name, source.obstacles, source.stamp_ns, source.frame_id)
        if before.goals is not None:
            self.set_goals(before.goals, before.goals_frame, before.goal_heights, before.goal_objects)


def _describe_unused(library: Sequence[Demonstration], frame_id: str, obstacles: Obstacles) -> str:
    """Return why none of the demonstrations can count in a frame among obstacles; empty if one can, or if there are none."""
    here = dict.fromkeys(each.ids for each in library if frame_id in ('', each.frame_id))
    if library and not here:
        frames = ', '.join(sorted({f"'{each.frame_id}'" for each in library}))
        return f"none of its paths counts: they are in the frame {frames}, the working frame is '{frame_id}'"
    present = set(obstacles.ids)
    missing = min((sorted(set(ids) - present) for ids in here), key=len, default=[])
    names = shorten(', '.join(map(repr, missing)), 200, placeholder=' ...')
    return names and f'none of its paths counts: they pass obstacles that the scene does not have: {names}'
