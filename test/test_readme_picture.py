# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pictures of README and concepts exist, their scripts draw them, and the tables of the examples are current."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from report_samples import predictions, samples

from foc_ros.reporting.views import build_hand_trajectory, build_snapshot

ROOT = Path(__file__).resolve().parents[1]


def script(name: str) -> ModuleType:
    """Import a file of scripts/, which is not a package."""
    sys.path.insert(0, str(ROOT / 'scripts'))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(ROOT / 'scripts'))


@pytest.mark.parametrize(('name', 'start'), [('scene.png', b'\x89PNG\r\n\x1a\n'), ('demo.gif', b'GIF89a')])
def test_the_pictures_are_in_the_readme(name: str, start: bytes) -> None:
    assert f'](doc/images/{name})' in (ROOT / 'README.md').read_text(encoding='utf-8')
    picture = (ROOT / 'doc' / 'images' / name).read_bytes()
    assert picture.startswith(start)
    assert len(picture) < 2_000_000


def test_the_animation_covers_a_movement(tmp_path: Path) -> None:
    moving = script('pictures')
    made = samples(1)
    drawn = list(moving.pictures(build_hand_trajectory(made), [build_snapshot(each) for each in predictions(made)], (0,)))
    assert 10 < len(drawn) <= moving.PICTURES
    lengths = [len(figure.axes[1].lines[0].get_xdata()) for figure, _ in drawn]
    assert all(np.diff(lengths) > 0)
    moving.save_animation(drawn[:3], tmp_path / 'demo.gif')
    assert (tmp_path / 'demo.gif').read_bytes().startswith(b'GIF89a')


@pytest.mark.parametrize('name', ['noise', 'surrogate', 'strategies', 'classes', 'likelihood'])
def test_concepts_have_their_pictures(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    concepts = script('pictures')
    monkeypatch.setattr(concepts, 'SAMPLES', 500)
    figure = concepts.FIGURES[f'concept_{name}']()
    assert all(axes.has_data() or axes.texts or axes.get_legend() for axes in figure.axes)
    assert f'](images/concept_{name}.png)' in (ROOT / 'doc' / 'concepts.md').read_text(encoding='utf-8')
    assert (ROOT / 'doc' / 'images' / f'concept_{name}.png').exists()


def test_example_tables_equal_those_of_the_script(tmp_path: Path) -> None:
    script('recordings').write_tables(tmp_path)
    for file in tmp_path.iterdir():
        assert file.read_bytes() == (ROOT / 'doc' / 'examples' / file.name).read_bytes(), file.name
