"""What clocks know of the inputs and stamps do not: that a source has fallen silent, that a pose comes late.

The pipeline goes by the stamps of messages alone, so that a replay needs no clock. A node has two: the steady clock tells how
long a source has been silent, and ROS time, where the poses' stamps are of it, how old a pose is.
"""

from __future__ import annotations

from collections.abc import Iterable

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import CLOUD, HAND, MARKERS

SOURCES = {'cloud': CLOUD, 'markers': MARKERS}
"""Topic of every source of obstacles in the scene."""


class Freshness:
    """Told of every message taken; :meth:`not_ready_reason` says why nothing is to be predicted now. Times: steady clock [s]."""

    def __init__(self) -> None:
        self._heard_s: dict[str, float] = {}
        self._age_s = 0.0
        self._same_clock = False
        self._moving = False

    def heard(self, role: str, now_s: float) -> None:
        """Note that an input's message was taken."""
        self._heard_s[role] = now_s

    def pose(self, stamp_ns: int, clock_ns: int, timeout_s: float, *, restarted: bool) -> None:
        """Note a pose's age by ROS time.

        Stamps are judged by it once a movement began with a pose of the present: a recording that is played with its own
        stamps, without `use_sim_time`, has none.
        """
        self._age_s = (clock_ns - stamp_ns) / NANOSECONDS
        if clock_ns and (restarted or not self._moving):
            self._same_clock = self._same_clock or abs(self._age_s) <= timeout_s
            self._moving = True

    def forget(self) -> None:
        """Forget by which clock the poses are stamped."""
        self._same_clock = self._moving = False

    def not_ready_reason(self, now_s: float, config: Config, sources: Iterable[str]) -> tuple[str, str] | None:
        """Return why nothing can be predicted, as (kind, words with numbers); None where it can.

        sources: of obstacles, of which one that is silent is enough; silence does not mean that its obstacles have gone.
        """
        limit_s = config.estimator.hand_timeout_s
        silence_s = now_s - self._heard_s.get(HAND, now_s)
        if 0.0 < limit_s < silence_s:
            return 'hand_silent', f'hand_pose silent for {silence_s:.1f} s (estimator.hand_timeout_s is {limit_s:g})'
        if self._same_clock and 0.0 < limit_s < abs(self._age_s):
            relation = 'older' if self._age_s > 0.0 else 'newer'
            words = f'the hand pose is {abs(self._age_s):.3g} s {relation} than the time of the node'
            return 'hand_stale', f'{words} (estimator.hand_timeout_s is {limit_s:g})'
        limit_s = config.scene.timeout_s
        for role in (SOURCES[source] for source in sources):
            silence_s = now_s - self._heard_s.get(role, now_s)
            if 0.0 < limit_s < silence_s:
                return 'obstacles_silent', f'{role} silent for {silence_s:.1f} s (scene.timeout_s is {limit_s:g})'
        return None
