"""The scene: obstacles from several sources, each the whole table of its source, merged and moved on to a stamp."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from foc_ros.core.types import NANOSECONDS, Array, Obstacles, Record, make_obstacles


@dataclass(frozen=True)
class ObstacleSource:
    """What one source said last: its obstacles, each id once, the stamp they hold for (None: always), the frame they are in."""

    obstacles: Obstacles
    stamp_ns: int | None
    frame_id: str

    def at(self, stamp_ns: int) -> Obstacles:
        """Return the obstacles moved on at their velocity to a stamp [ns]; unstamped ones stay where they are."""
        return self.obstacles if self.stamp_ns is None else self.obstacles.after((stamp_ns - self.stamp_ns) / NANOSECONDS)


@dataclass(frozen=True, eq=False)
class Scene(Record):
    """Obstacles by source, in order of arrival, and the goals (g, 2) [m], None until some were received."""

    parts: dict[str, ObstacleSource] = field(default_factory=dict)
    goals: Array | None = None
    goals_frame: str = ''

    def with_part(self, source: str, part: ObstacleSource) -> Scene:
        """Return the scene with one source's obstacles replaced; that source is now the latest."""
        parts = {name: held for name, held in self.parts.items() if name != source}
        return replace(self, parts=parts | {source: part})

    def with_goals(self, goals: Array, frame_id: str) -> Scene:
        """Return the scene with all goals replaced."""
        return replace(self, goals=np.array(goals, dtype=float).reshape(-1, 2), goals_frame=frame_id)

    def obstacles(self, stamp_ns: int) -> Obstacles:
        """Return all obstacles at a stamp [ns]: the union over the sources, where the latest source's row of an id holds."""
        tables = [part.at(stamp_ns) for part in self.parts.values()]
        if len(tables) < 2:
            return tables[0] if tables else make_obstacles()
        ids = [name for table in tables for name in table.ids]
        latest = {name: row for row, name in enumerate(ids)}
        return _stacked(tables, ids).take(sorted(latest.values()))

    def not_ready_reason(self, stamp_ns: int, timeout_s: float) -> tuple[str, str] | None:
        """Return why nothing can be predicted at a hand's stamp [ns], as (kind, words with numbers); None where it can.

        A source is stale where its stamp is more than timeout_s [s] from the hand's, either way; 0: never. One stale source is
        enough: its silence does not mean that its obstacles have gone.
        """
        if not self.parts:
            return 'no_obstacles', 'no obstacles received yet: publish an empty cloud for an empty scene'
        if self.goals is None:
            return 'no_goal', 'no goal received'
        if not len(self.goals):
            return 'no_goal', 'no goal: the last goals message was empty'
        ages = [(stamp_ns - part.stamp_ns) / NANOSECONDS for part in self.parts.values() if part.stamp_ns is not None]
        age = max(ages, key=abs, default=0.0)
        if 0.0 < timeout_s < abs(age):
            relation = 'older' if age > 0.0 else 'newer'
            return 'stale', f'obstacles are {abs(age):.3g} s {relation} than the hand pose (scene.timeout_s is {timeout_s:g})'
        return None


def _stacked(tables: list[Obstacles], ids: list[str]) -> Obstacles:
    return Obstacles(
        tuple(ids),
        np.concatenate([table.centre for table in tables]),
        np.concatenate([table.radius for table in tables]),
        np.concatenate([table.radius_stddev for table in tables]),
        np.concatenate([table.velocity for table in tables]),
        np.concatenate([table.centre_covariance for table in tables]),
    )
