# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Short recordings for tests."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from mcap.writer import Writer
from rosbags.rosbag2 import Writer as BagByRosbags

from foc_ros.core.config import Config, replace_values
from foc_ros.io.bags import TYPESTORE, BagWriter
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RosbagsTypes
from foc_ros.ros.parameters import dump_parameter_file

TYPES = RosbagsTypes(TYPESTORE)
CONFIG = replace_values(Config(), {'foc.strategy': 'fixed', 'foc.tau': 5e-4, 'foc.steps': 30})
"""With it, every class of these recordings is solved, whatever eta is reachable."""
FRAME = 'world'
STORE = TYPESTORE
START_NS = 5_000_000_000
SCENE = [(0.15, 0.0, 0.0, 0.03, 0.002, 7)]
GOAL = np.array([[0.3, 0.0, 0.0]])


def ns(seconds: float) -> int:
    return START_NS + round(seconds * 1e9)


def reach(seconds: float = 0.6, rate_hz: float = 50.0) -> list[tuple[float, np.ndarray]]:
    """Times and positions of a minimum-jerk reach of 0.3 m in 1 s, with a bulge of 5 cm to the left, for `seconds`."""
    times = np.arange(0.0, seconds, 1 / rate_hz)
    s = 10 * times**3 - 15 * times**4 + 6 * times**5
    return [(time, np.array([0.3 * part, 0.05 * np.sin(np.pi * part), 0.1])) for time, part in zip(times, s, strict=True)]


def messages(seconds: float = 0.6, rate_hz: float = 50.0, scene_hz: float = 5.0) -> list[tuple[str, int, Any]]:
    """A reach past one obstacle: (topic, stamp [ns], message), in order."""
    out = []
    for time in np.arange(-0.1, seconds, 1 / scene_hz):
        out.append(('/obstacles', ns(time), encode_obstacles(TYPES, ns(time), FRAME, SCENE)))
        out.append(('/goals', ns(time), encode_goals(TYPES, ns(time), FRAME, GOAL)))
    out += [
        ('/hand_pose', ns(time), encode_hand_pose(TYPES, ns(time), FRAME, position)) for time, position in reach(seconds, rate_hz)
    ]
    return sorted(out, key=lambda item: item[1])


def write_bag(path: Path, items: Iterable[tuple[str, int, Any]] | None = None, rename: dict[str, str] | None = None) -> Path:
    """Write a bag; rename: other topic names, '' omits a topic."""
    names = rename or {}
    with BagWriter(path) as writer:
        for topic, stamp_ns, message in messages() if items is None else items:
            if names.get(topic, topic):
                writer.write(names.get(topic, topic), message, stamp_ns)
    return path


def write_by_rosbags(path: Path, items: Iterable[tuple[str, int, Any]], store: Any = STORE, **options: Any) -> None:
    """Write a bag with the library rosbags alone; store: of the message types; options: of its writer."""
    with BagByRosbags(path, **options) as writer:
        connections: dict[str, Any] = {}
        for topic, stamp_ns, message in items:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp_ns, store.serialize_cdr(message, kind))


def write_mcap(
    path: Path,
    items: Iterable[tuple[str, int, Any]],
    per_chunk: int = 1000,
    odd: Mapping[str, tuple[str, str, str, bytes]] = MappingProxyType({}),
    kinds: Mapping[str, str] = MappingProxyType({}),
    **options: Any,
) -> list[int]:
    """Write an MCAP file as a recorder does, with a number of messages in each chunk; return where the chunks end.

    odd: by topic, encoding of messages, name, encoding and text of the schema, for a channel with one message; kinds: other names
    of message types; options: of the library's writer.
    """
    ends, channels = [], {}
    with path.open('wb') as stream:
        writer = Writer(stream, **options)
        writer.start('ros2')
        for topic, (encoding, name, form, text) in odd.items():
            channel = writer.register_channel(topic, encoding, writer.register_schema(name, form, text) if name else 0)
            writer.add_message(channel, START_NS, b'{}', START_NS)
        for i, (topic, stamp_ns, message) in enumerate(items, 1):
            kind = message.__msgtype__
            if topic not in channels:
                text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
                channels[topic] = writer.register_channel(
                    topic, 'cdr', writer.register_schema(kinds.get(kind, kind), 'ros2msg', text)
                )
            writer.add_message(channels[topic], stamp_ns, bytes(STORE.serialize_cdr(message, kind)), stamp_ns)
            if i % per_chunk == 0:
                writer.flush()
                ends.append(stream.tell())
        writer.finish()
    return ends


def write_parameters(folder: Path, config: Config = CONFIG) -> str:
    file = folder / 'foc.yaml'
    file.write_text(dump_parameter_file(config), 'utf-8')
    return str(file)
