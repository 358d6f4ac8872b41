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
    rate_hz: 5.0
    foc: {steps: 20}
    homotopy: {max_candidates: 2}
    guidance: {clearance: 0.0}
"""


def replay(folder: Path, capsys: pytest.CaptureFixture[str], *options: str) -> dict:
    (folder / 'parameters.yaml').write_text(PARAMETERS, 'utf-8')
    assert main(['replay', str(RECORDING), '--params', str(folder / 'parameters.yaml'), '--json', *options]) == 0
    return json.loads(capsys.readouterr().out)


def test_guidance_is_the_same_each_time_and_within_its_limits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    guidance = replay(tmp_path, capsys, '--guidance')['guidance']
    assert guidance == replay(tmp_path, capsys, '--guidance')['guidance']
    stamps, forces = np.array([each['stamp_ns'] for each in guidance]), np.array([each['force'] for each in guidance])
    periods, settings = np.diff(stamps), GuidanceConfig()
    assert set(periods.tolist()) == {5_000_000}
    assert 0.0 < np.hypot(*forces.T).max() <= settings.f_max * (1 + 1e-9)
    assert np.hypot(*np.diff(forces, axis=0).T).max() <= settings.slew * 0.005 * (1 + 1e-9)


def test_predictions_do_not_depend_on_guidance(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain, guided = replay(tmp_path, capsys), replay(tmp_path, capsys, '--guidance')
    assert 'guidance' not in plain
    assert [each['most_likely'] for each in plain['predictions']] == [each['most_likely'] for each in guided['predictions']]


def test_the_output_bag_has_the_topics_of_the_node(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from rosbags.highlevel import AnyReader

    bag = tmp_path / 'bag'
    guidance = replay(tmp_path, capsys, '--guidance', '--output', str(bag))['guidance']
    with AnyReader([bag]) as reader:
        counts = {each.topic: each.msgcount for each in reader.connections}
    assert counts['/foc/guidance/wrench'] == counts['/foc/guidance/reference'] == len(guidance)
    assert counts['/foc/guidance/stiffness'] == len(guidance)
    with BagReader(bag):  # a recording of guidance can be replayed: its outputs are taken for no input
        pass
