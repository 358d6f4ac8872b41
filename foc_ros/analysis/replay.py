"""A recording through the predictor in the recording's own time: without ROS, clock or waiting, so that results repeat."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from foc_ros.core.config import Config
from foc_ros.core.obstacles.scene import Scene
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import HandSample, Prediction
from foc_ros.io.bags import BagReader, Item
from foc_ros.io.class_library import load_library
from foc_ros.io.topics import HAND
from foc_ros.ros.intake import Intake


@dataclass(frozen=True)
class Step:
    """One recorded message and its effect.

    item: the message; sample: its hand sample, None for other messages and for a rejected one; prediction: made from the sample,
    None where none was due or possible; scene: the scene of the prediction.
    """

    item: Item
    sample: HandSample | None
    prediction: Prediction | None
    scene: Scene


class Replay:
    """Feeds recorded messages to a pipeline as the node does live; `intake` keeps the counts.

    Raises RecordingError or InputError where the class library cannot be used.
    """

    def __init__(self, config: Config) -> None:
        self.pipeline = Pipeline(config, load_library(config.homotopy.library))
        self.intake = Intake(self.pipeline)

    def steps(self, items: Iterable[Item]) -> Iterator[Step]:
        """Process the messages in their order and yield the effect of each."""
        for item in items:
            status = self.intake.take(item.role, item.message)
            is_hand = item.role == HAND
            prediction = self.pipeline.predict() if is_hand and self.pipeline.is_due else None
            sample = self.intake.sample if is_hand and status is not None and status.is_taken else None
            yield Step(item, sample, prediction, self.pipeline.scene)


def replay(bag: Path | str, config: Config, chosen: Mapping[str, str] | None = None) -> Iterator[Prediction]:
    """Yield every prediction of a recording; chosen: topic by input name. Raises RecordingError."""
    with BagReader(bag, chosen) as reader:
        for step in Replay(config).steps(reader):
            if step.prediction is not None:
                yield step.prediction
