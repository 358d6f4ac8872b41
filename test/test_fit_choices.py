"""How to arrive, and what durations follow from: taken where recordings tell it for sure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fit_recordings import demonstration, write_tables

import foc_ros.fitting.search as searching
from foc_ros.evaluation.lanes import Lanes
from foc_ros.evaluation.recordings import find_recordings
from foc_ros.fitting.duration_fit import other_models
from foc_ros.fitting.found import Fit
from foc_ros.fitting.replays import ARRIVAL, levels, preferred
from foc_ros.foc.config import Config, updated
from foc_ros.foc.records import make_obstacles

CONFIG = updated(Config(), {'foc.steps': 15, 'homotopy.max_candidates': 2, 'rate_hz': 4.0})
GOAL = np.array([[0.3, 0.0]])


def _scores(monkeypatch: pytest.MonkeyPatch, scores: list[list[float]]) -> Fit:
    """Search how the hand arrives, with these scores of positions, by recording, of the given and the other setting."""
    monkeypatch.setattr(searching, 'observed', lambda *_: ([], {}))
    monkeypatch.setattr(searching, 'scored', lambda *_: None)
    monkeypatch.setattr(searching, 'compared', lambda *_: np.array([np.zeros_like(scores), scores]))
    found = Fit(CONFIG)
    with Lanes(1) as executor:
        searching.search(ARRIVAL, levels(ARRIVAL, CONFIG), {}, found, {}, executor, {})
    return found


def test_another_way_to_arrive_is_taken_where_it_is_better_for_sure(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _scores(monkeypatch, [[0.0] * 8, [0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, -0.1]])
    assert found.chosen == {'duration.arrival': 'passing'} and found.config.duration.arrival == 'passing'


def test_what_is_given_is_kept_where_another_is_not_better_for_sure(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _scores(monkeypatch, [[0.0] * 8, [1.5, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2]])
    assert found.chosen == {} and found.config == CONFIG
    assert any(words.startswith('duration.arrival: passing is better than rest, but only in ') for words in found.warnings)


def test_ways_come_first_and_positions_where_ways_do_not_tell() -> None:
    positions = np.array([[0.0, 0.0, 0.0, 0.0], [5.0, 5.0, 5.0, 5.0], [1.0, 1.0, 1.0, 1.0]])
    surely_worse = np.array([[1.0, 1.2, 1.1, 1.0], [0.5, 0.8, 0.5, 0.6], [0.9, 1.4, 1.0, 0.9]])
    assert preferred(np.array([surely_worse, positions])) == 2
    assert preferred(np.array([np.zeros((3, 4)), positions])) == 1


def test_the_other_models_of_duration_come_with_their_constants_fitted() -> None:
    t = np.arange(0.0, 1.61, 0.02)
    s = np.clip((t - 0.1) / 1.5, 0.0, 1.0)
    path = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None] * GOAL
    reaches = [demonstration(str(number), t, path, make_obstacles(), GOAL) for number in range(3)]
    (priced,) = other_models(reaches, CONFIG)
    assert priced.duration.model == 'cost_of_time'
    assert (3600.0 * 0.3**2 / priced.duration.time_cost) ** (1 / 6) == pytest.approx(1.5, rel=0.1)
    given = updated(CONFIG, {'duration.model': 'fixed'})
    assert [each.duration.model for each in other_models(reaches, given)] == ['fitts', 'cost_of_time']


def test_reaches_that_end_at_rest_are_known_as_such(tmp_path: Path) -> None:
    recordings = find_recordings(write_tables(tmp_path / 'data', count=4, obstacle=False, hz=30.0))
    found = Fit(CONFIG)
    with Lanes(1) as executor:
        searching.search(ARRIVAL, levels(ARRIVAL, CONFIG), recordings, found, {}, executor, {})
    assert found.chosen == {}
