# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The channels of stored recordings: a topic with its message type, and the decoding of its messages.

A message type is named `pkg/msg/Type`; older recorders leave `msg` out. What is not in the encoding of ROS 2 is not read, and
its type says so wherever a message lists the topics.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import parse_qos
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from foc_ros.core.errors import MessageError, warn

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
"""Message definitions for written bags, and for what a recording does not define itself."""
ENCODING = 'cdr'
_PADDING = (0, 4, 8)
"""Zeros that may follow a message, in addition to the three bytes that rosbags allows [bytes]. rclpy ignores them."""


@dataclass(frozen=True, eq=False)
class Channel:
    """A topic of one file.

    kind: message type; encoding: of the messages; form, definition: language and text of the definition of the type, if it is
    stored; qos: the offered quality of service as YAML; count: number of messages; key: the channel within its file.
    """

    key: int
    topic: str
    kind: str
    encoding: str
    form: str
    definition: str
    qos: str
    count: int

    @property
    def is_read(self) -> bool:
        """Whether the messages have the encoding of ROS 2."""
        return self.encoding == ENCODING and bool(self.kind)

    @cached_property
    def msgtype(self) -> str:
        """The message type as ROS 2 names it, also where that of DDS is stored; for a channel that is not read, this in words."""
        name = self.kind.replace('::', '/')
        name = re.sub(r'^(\w+)/(?:msg/)?(?:dds_/)?(\w+?)_*$', r'\1/msg/\2', name)
        if self.is_read:
            return name
        if self.encoding == 'ros1':
            return f'{name} in ROS 1 encoding, which is not read: convert the recording to ROS 2'
        return f'{name or "no type"} in encoding {self.encoding or "unknown"}, which is not read'

    @cached_property
    def typestore(self) -> Typestore:
        """The definitions of the recording, and :data:`TYPESTORE` for what they do not contain."""
        store, text = get_typestore(Stores.EMPTY), '\n'.join(self.definition.splitlines())
        try:
            if self.form == 'ros2idl':
                for part in re.split(r'^=+\nIDL: .*\n', text, flags=re.MULTILINE):
                    store.register(get_types_from_idl(part) if part else {})
            elif self.form == 'ros2msg' and text.strip():
                store.register(get_types_from_msg(text, self.msgtype))
        except Exception:  # any text may stand there
            warn(f'topic {self.topic}: its definition of {self.msgtype} cannot be read, and that of ROS is used')
        store.fielddefs = {**TYPESTORE.fielddefs, **store.fielddefs}
        store.types = {**TYPESTORE.types, **store.types}
        return store

    def read_qos(self) -> list[Qos]:
        """Return the offered quality of service, none where the recorder stored something else."""
        try:
            return parse_qos(self.qos)
        except Exception:  # any text may stand there, and no message depends on it
            return []

    def decode(self, raw: bytes) -> Any:
        """Return a message, or the MessageError that says why the bytes are none."""
        reason = Exception()
        for end in [len(raw) - zeros for zeros in _PADDING if not any(raw[len(raw) - zeros :])]:
            try:
                return self.typestore.deserialize_cdr(raw[:end], self.msgtype)
            except Exception as error:  # wrong bytes make the decoder fail in many ways
                reason = error
        return MessageError('message', f'a serialized {self.msgtype}', f'{len(raw)} other bytes ({reason})')
