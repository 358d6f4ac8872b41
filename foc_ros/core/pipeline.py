"""What node and replay both feed: messages in, by their stamps; at most one prediction for every hand sample out.

Driven by message time alone: no clock is read, so the same messages give the same predictions, live or replayed.
"""

from __future__ import annotations

from collections.abc import Sequence

from .config import Config
from .errors import FocError
from .estimation.kalman_filter import FilterState, update
from .homotopy.demonstrations import Demonstration
from .memory import Memory
from .obstacles.scene import ObstacleSource, Scene
from .predictor import predict
from .rejections import Rejections
from .sample_status import SampleStatus
from .types import NANOSECONDS, Array, HandSample, Obstacles, Prediction

__all__ = ['Pipeline', 'SampleStatus']


class Pipeline:
    """Follows the hand, keeps the scene, and predicts when a fresh hand sample is due.

    library: demonstrated ways to recall.

    Attributes: config; hand_state, None until a hand sample came; scene; engaged; frame_id, the working frame, None until the
    parameter or the first hand sample fixes it.
    """

    def __init__(self, config: Config, library: Sequence[Demonstration] = ()) -> None:
        self.config = config
        self._library = tuple(library)
        self.hand_state: FilterState | None = None
        self.scene = Scene()
        self.engaged = True
        self.frame_id = config.frame_id or None
        self._refusals = Rejections()
        self._memory = Memory()
        self._fresh = False
        self._tried = False
        self._predicted_ns: int | None = None

    @property
    def counts(self) -> dict[str, int]:
        """How often each kind of refusal, drop, restart or failure occurred, by name."""
        return dict(self._refusals.counts)

    @property
    def refused(self) -> int:
        """How many refusals there were, of all kinds."""
        return self._refusals.refused

    @property
    def last_refusal(self) -> str | None:
        """The text of the last refusal."""
        return self._refusals.last

    @property
    def due(self) -> bool:
        """Whether there is a hand sample since the last prediction, 1 / rate_hz or more after it (or any, after a restart)."""
        if self.hand_state is None or not self._fresh or not self.engaged:
            return False
        period_ns = int(NANOSECONDS / self.config.rate_hz)
        return self._predicted_ns is None or self.hand_state.stamp_ns - self._predicted_ns >= period_ns

    def hand(self, sample: HandSample) -> SampleStatus:
        """Take a hand sample. The first one fixes the working frame where the parameter leaves it open."""
        if not self._refusals.in_frame('hand_wrong_frame', 'hand_pose', sample.frame_id, self.frame_id):
            return SampleStatus.WRONG_FRAME
        before, superseded = self.hand_state, self.due and not self._tried and self.blocked() is None
        answer = update(before, sample, self.config.estimator)
        if not answer.verdict.taken:
            assert before is not None
            self._refusals.behind(f'hand_{answer.verdict}', 'hand_pose', sample.stamp_ns, before.stamp_ns)
            return answer.verdict
        if self.frame_id is None:
            self._settle_frame(sample.frame_id)
        self.hand_state, self._fresh, self._tried = answer.state, True, False
        if superseded:
            self._refusals.count('hand_superseded')
        if answer.verdict.restarted:
            self._refusals.count(f'hand_{answer.verdict}')
            self._forget_predictions()
        if not self.engaged:
            self._refusals.refuse('hand_disengaged', 'hand_pose: disengaged, nothing is predicted')
            return SampleStatus.DISENGAGED
        return answer.verdict

    def set_obstacles(self, source: str, obstacles: Obstacles, stamp_ns: int | None, frame_id: str) -> SampleStatus:
        """Replace what one source ('cloud' or 'markers') says; stamp 0 or None: not judged by age, not moved on.

        A table late by no more than `estimator.gap_s` does not replace a newer one of the same source.
        """
        if not self._refusals.in_frame('obstacles_wrong_frame', source, frame_id, self.frame_id):
            return SampleStatus.WRONG_FRAME
        held = self.scene.parts.get(source)
        newest_ns = held.stamp_ns if held is not None else None
        if stamp_ns and newest_ns and 0 < newest_ns - stamp_ns <= self.config.estimator.gap_s * NANOSECONDS:
            self._refusals.behind('obstacles_late', source, stamp_ns, newest_ns)
            return SampleStatus.LATE
        self.scene = self.scene.with_part(source, ObstacleSource(obstacles, stamp_ns or None, frame_id))
        return SampleStatus.ACCEPTED

    def set_goals(self, goals: Array, frame_id: str) -> SampleStatus:
        """Replace all goals, (g, 2) [m]; none is a way to take them back."""
        if not self._refusals.in_frame('goals_wrong_frame', 'goals', frame_id, self.frame_id):
            return SampleStatus.WRONG_FRAME
        self.scene = self.scene.with_goals(goals, frame_id)
        return SampleStatus.ACCEPTED

    def predict(self) -> Prediction | None:
        """Predict from the newest hand sample; None, counted and explained in `last_refusal`, where that cannot be done."""
        self._tried = True
        not_ready_reason = self._not_ready_reason()
        if not_ready_reason is None and not self.due:
            not_ready_reason = ('not_due', 'no hand pose since the last prediction that is 1/rate_hz after it')
        if not_ready_reason is not None:
            self._refusals.refuse(f'predict_{not_ready_reason[0]}', not_ready_reason[1])
            return None
        assert self.hand_state is not None
        assert self.scene.goals is not None
        self._fresh, self._predicted_ns = False, self.hand_state.stamp_ns
        obstacles = self.scene.obstacles(self.hand_state.stamp_ns)
        try:
            prediction, self._memory = predict(
                self.config, self.hand_state, obstacles, self.scene.goals, self._memory, self._library
            )
        except FocError as error:
            self._refusals.refuse('predict_failed', str(error))
            return None
        for outcome in prediction.candidates:
            if not outcome.is_solved:
                self._refusals.count(f'candidate_{outcome.solution.status.value}')
        if not prediction.solved_candidates:
            self._refusals.count('predict_nothing_solved')
        return prediction

    def blocked(self) -> str | None:
        """Return why nothing can be predicted now, in words with numbers; None where it can."""
        not_ready_reason = self._not_ready_reason()
        return None if not_ready_reason is None else not_ready_reason[1]

    def engage(self, on: bool) -> None:
        """Close or open the clutch: while disengaged the hand is followed, but nothing is predicted."""
        if on != self.engaged:
            self._forget_predictions()
            self._fresh = False
        self.engaged = on

    def reset(self) -> None:
        """Forget the movement, keep the scene, the working frame and the counts."""
        self.hand_state, self._fresh = None, False
        self._forget_predictions()

    def reconfigure(self, config: Config) -> None:
        """Go on with other parameters. Movement and scene are kept, unless the plane or the working frame is another one."""
        if config.plane != self.config.plane:
            self.reset()
            self.scene = Scene()
        if config.frame_id and config.frame_id != self.frame_id:
            self.reset()
            self._settle_frame(config.frame_id)
        self.config = config
        self._memory = Memory(self._memory.most_likely)

    def _not_ready_reason(self) -> tuple[str, str] | None:
        if not self.engaged:
            return 'disengaged', 'disengaged'
        if self.hand_state is None:
            return 'no_hand', 'no hand pose yet'
        return self.scene.not_ready_reason(self.hand_state.stamp_ns, self.config.scene.timeout_s)

    def _forget_predictions(self) -> None:
        self._memory, self._predicted_ns = Memory(), None

    def _settle_frame(self, frame_id: str) -> None:
        """Fix the working frame; what came earlier in another one is dropped now."""
        held, self.frame_id, self.scene = self.scene, frame_id, Scene()
        for source, part in held.parts.items():
            self.set_obstacles(source, part.obstacles, part.stamp_ns, part.frame_id)
        if held.goals is not None:
            self.set_goals(held.goals, held.goals_frame)
