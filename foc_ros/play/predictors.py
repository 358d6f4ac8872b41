"""What predicts behind the page: one interface, and the library without ROS. The node over DDS is in `node_predictor`.

Messages enter and leave as the bytes that DDS transports and bags hold, so that the rest of the folder does not depend on which
of the two predicts.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from logging import getLogger
from queue import SimpleQueue
from threading import Thread
from time import monotonic

from foc_ros.core.config import Config
from foc_ros.core.deadline import Deadline
from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.predict import warm_up
from foc_ros.io.bags import TYPESTORE
from foc_ros.io.class_library import load_library
from foc_ros.io.topics import HAND, TYPES
from foc_ros.ros.guidance_loop import GuidanceLoop
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS, Place
from foc_ros.ros.messages.encode_prediction import OUTPUTS, encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes

NODE = '/foc'
"""Name of the node in the topics."""
SENT = ('prediction', 'likelihoods')
"""Outputs of a prediction that are used; markers and path say nothing more, and to encode them takes several times as long."""
KINDS = {f'{NODE}/{name}': OUTPUTS[name][0] for name in SENT} | {
    f'{NODE}/{name}': kind for name, (kind, _) in GUIDANCE_OUTPUTS.items()
}
"""Message type by topic of every output that is used."""

COUNTERS = {
    'hand_superseded': 'positions were passed over, because this computer is busy',
    'predict_over_budget': 'predictions took longer than budget_s, because this computer is busy',
    'predict_too_late': 'predictions came too late, because this computer is busy',
    'predict_nothing_solved': 'predictions found no way',
    'scene_hand_inside': 'predictions began within the margin of an obstacle',
    'scene_goal_inside': 'predictions had a goal within an obstacle',
    'scene_no_way': 'predictions had a goal to which there is no way',
}
"""Words for the most frequent counters of the diagnostics; the number follows them."""

Receive = Callable[[str, bytes], None]
"""Takes topic and bytes of an output, in any thread."""


@dataclass(frozen=True)
class State:
    """Whether the predictor is there, and in words what it does."""

    is_alive: bool
    text: str


def describe_health(message: str) -> str:
    """Return a message of the diagnostics with its counters, such as `hand_superseded 3`, in words, after what the node does."""
    parts = message.split('; ')
    counters = [part.rpartition(' ') for part in parts if part.partition(' ')[0] in COUNTERS]
    others = [part for part in parts if part.partition(' ')[0] not in COUNTERS]
    return '; '.join([*(others or ['predicting']), *(f'{COUNTERS[name]}: {count}' for name, _, count in counters)])


class LivePredictor(ABC):
    """Takes messages of the inputs and passes on those of the outputs, between `start` and `stop`.

    Parameters
    ----------
    config
        The parameters with which it begins.
    receive
        Called with every output, in another thread.
    """

    name: str

    def __init__(self, config: Config, receive: Receive) -> None:
        self.config = config
        self.receive = receive

    @abstractmethod
    def start(self) -> None:
        """Begin to predict."""

    @abstractmethod
    def stop(self) -> None:
        """End; nothing is received after that."""

    @abstractmethod
    def send(self, role: str, raw: bytes) -> None:
        """Take a message of an input."""

    @abstractmethod
    def configure(self, config: Config) -> None:
        """Use other parameters; movement and scene are kept."""

    @abstractmethod
    def check(self) -> State:
        """Return the state, and start what has ended unexpectedly; to be called about twice a second."""


class LibraryPredictor(LivePredictor):
    """The pipeline and the guidance of the node, without a node, in two threads of this process."""

    name = 'library, without ROS'

    def __init__(self, config: Config, receive: Receive) -> None:
        super().__init__(config, receive)
        self._intake = Intake(Pipeline(config, load_library(config.homotopy.library)))
        self._queue: SimpleQueue[tuple[str, bytes] | Config | None] = SimpleQueue()
        self._types, self._guidance_types = RosbagsTypes(TYPESTORE), RosbagsTypes(TYPESTORE)  # one for each thread
        self._error = ''
        self._guidance = GuidanceLoop(config, self._send_guidance, self._note_error, getLogger(__name__).warning)
        self._thread = Thread(target=self._run, name='prediction', daemon=True)

    def start(self) -> None:
        """Begin to predict."""
        warm_up(self.config)
        self._guidance.set_released(False)
        self._guidance.start()
        self._thread.start()

    def stop(self) -> None:
        """End both threads."""
        self._queue.put(None)
        self._thread.join()
        self._guidance.stop()

    def send(self, role: str, raw: bytes) -> None:
        """Take a message of an input."""
        self._queue.put((role, raw))

    def configure(self, config: Config) -> None:
        """Use other parameters, after the messages that were sent before."""
        self._queue.put(config)

    def check(self) -> State:
        """Return what the pipeline does; an internal error ends a prediction, and not the thread."""
        text = self._error or self._intake.pipeline.not_ready_reason() or 'predicting'
        return State(self._thread.is_alive(), text)

    def _run(self) -> None:
        while True:
            waiting = [self._queue.get()]
            while not self._queue.empty():
                waiting.append(self._queue.get())
            for each in waiting:
                if each is None:
                    return
                self._take(each)
            try:
                self._predict()
            except Exception as error:
                self._note_error(error)
                self._intake.pipeline.reset()

    def _take(self, given: tuple[str, bytes] | Config) -> None:
        if isinstance(given, Config):
            self.config = given
            self._intake.pipeline.reconfigure(given)
            self._guidance.reconfigure(given)
            return
        role, raw = given
        self._intake.take(role, TYPESTORE.deserialize_cdr(raw, TYPES[role]))
        if role == HAND:
            self._guidance.note_hand(self._intake.pipeline.hand_state, monotonic())

    def _predict(self) -> None:
        pipeline = self._intake.pipeline
        received_s = monotonic()
        prediction = pipeline.predict(Deadline(pipeline.config.budget_s or None)) if pipeline.is_due else None
        if prediction is None:
            return
        self._error = ''
        self._guidance.note_prediction(prediction, received_s)
        plane = pipeline.config.plane
        for name, message in encode_outputs(prediction, prediction.obstacles, plane, self._types, SENT).items():
            self._pass_on(name, message)

    def _send_guidance(self, output: GuidanceOutput, place: Place) -> None:
        for name, (_, encode) in GUIDANCE_OUTPUTS.items():
            self._pass_on(name, encode(output, place, self._guidance_types))

    def _pass_on(self, name: str, message: object) -> None:
        topic = f'{NODE}/{name}'
        self.receive(topic, bytes(TYPESTORE.serialize_cdr(message, KINDS[topic])))

    def _note_error(self, error: Exception) -> None:
        self._error = f'internal error: {error}'
