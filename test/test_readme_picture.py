"""The README's picture is there, and its script draws the moment it says."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from report_samples import predictions, samples, scene

from foc_ros.moments import moment_of, movements, track_of

ROOT = Path(__file__).resolve().parents[1]


def test_the_picture_is_in_the_readme() -> None:
    assert '](doc/images/scene.png)' in (ROOT / 'README.md').read_text(encoding='utf-8')
    assert (ROOT / 'doc' / 'images' / 'scene.png').read_bytes().startswith(b'\x89PNG\r\n\x1a\n')


def test_the_script_draws_the_beginning_of_its_movement() -> None:
    spec = importlib.util.spec_from_file_location('make_readme_picture', ROOT / 'scripts' / 'make_readme_picture.py')
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    made = samples(script.MOVEMENT)
    track, moments = track_of(made), [moment_of(each, *scene()) for each in predictions(made, every=2)]
    start_ns = movements(track, 0.05)[script.MOVEMENT - 1][0]
    shown = min(moments, key=lambda each: abs(each.stamp_ns - start_ns - script.AFTER_S * 1e9))
    drawn = [line.get_xydata() for line in script.picture(track, moments).axes[0].lines]
    for way in shown.ways:
        assert any(np.array_equal(line, way.path) for line in drawn)
    # the hand's past, its future, and where it is
    assert sum(np.isin(line[:, 0], track.positions[:, 0]).all() for line in drawn) >= 3
