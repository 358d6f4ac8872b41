# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Guidance in replay: deterministic, by stamps, in JSON and in the output bag."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from foc_ros.cli.main import main
from foc_ros.core.config import GuidanceConfig
from foc_ros.io.bags import BagReader

RECORDING = Path(__file__).parents[1] / 'foc_ros' / 'recordings' / 'reaching.mcap'
PARAMETERS = """
/**:
  ros__parameters:
    rate_hz: 2.0
    foc: {steps: 20}
    homotopy: {max_candidates: 2}
    guidance: {clearance: 0.0, rate_hz: 25.0, hold_s: 1.0}
"""


def replay(folder: Path, capsys: pytest.CaptureFixture[str], *options: str) -> dict:
    (folder / 'parameters.yaml').write_text(PARAMETERS, 'utf-8')
    assert main(['replay', str(RECORDING), '--params', str(folder / 'parameters.yaml'), '--json', *options]) == 0
    return json.loads(capsys.readouterr().out)


def check_bag(bag: Path, updates: int) -> None:
    """Check that an output bag has the topics of the node, and can be replayed: its outputs are taken for no input."""
    from rosbags.highlevel import AnyReader

    with AnyReader([bag]) as reader:
        counts = {each.topic: each.msgcount for each in reader.connections}
    assert {counts[f'/foc/guidance/{name}'] for name in ('wrench', 'reference', 'stiffness')} == {updates}
    with BagReader(bag):
        pass


def test_guidance_is_the_same_each_time_and_within_its_limits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / 'bag'
    answer = replay(tmp_path, capsys, '--guidance')
    guidance = answer['guidance']
    assert guidance == replay(tmp_path, capsys, '--guidance', '--output', str(bag))['guidance']
    check_bag(bag, len(guidance))
    plain = replay(tmp_path, capsys)
    assert 'guidance' not in plain
    assert [each['most_likely'] for each in plain['predictions']] == [each['most_likely'] for each in answer['predictions']]
    stamps, forces = np.array([each['stamp_ns'] for each in guidance]), np.array([each['force'] for each in guidance])
    periods, settings = np.diff(stamps), GuidanceConfig()
    assert set(periods.tolist()) == {40_000_000}
    assert 0.0 < np.hypot(*forces.T).max() <= settings.f_max * (1 + 1e-9)
    assert np.hypot(*np.diff(forces, axis=0).T).max() <= settings.slew * 0.04 * (1 + 1e-9)
