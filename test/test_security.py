# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Input from outside is bounded and never executed; the permissions of a secured graph are those of the node."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import ros_helpers

from foc_ros.core.errors import RecordingError
from foc_ros.io import csv_tables as tables
from foc_ros.io import documents
from foc_ros.io.documents import read_document

ROOT = Path(__file__).parents[1]
PERMISSIONS = ROOT / 'config' / 'sros2_policy.xml'


def sparse(file: Path, size: int) -> Path:
    with file.open('wb') as opened:
        opened.truncate(size)
    return file


def test_a_document_larger_than_any_scene_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='expected at most 5,000,000 bytes'):
        read_document(sparse(tmp_path / 'large.yaml', documents.MAX_BYTES + 1))


def test_a_table_larger_than_any_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='expected at most 1,000,000,000 bytes, got 1,000,000,001'):
        next(tables.read_rows(sparse(tmp_path / 'large.csv', tables.MAX_BYTES + 1), ('t_s',)))


@pytest.mark.parametrize('text', ['!!python/object/apply:os.mkdir [made]', '!!python/name:os.system', '!include other.yaml'])
def test_a_document_is_never_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'it.yaml').write_text(text, 'utf-8')
    with pytest.raises(RecordingError, match='not a YAML file'):
        read_document(tmp_path / 'it.yaml')
    assert [each.name for each in tmp_path.iterdir()] == ['it.yaml']


def allowed(kind: str, action: str) -> set[str]:
    profile = ET.parse(PERMISSIONS).getroot().find(".//profile[@node='foc']")
    groups = [each for each in profile.findall(kind) if each.get(action) == 'ALLOW']
    return {each.text.strip() for group in groups for each in group}


def test_the_permissions_are_those_that_the_node_needs(ros: ros_helpers.Graph) -> None:
    """The node needs all of them, and no others; the topic of a goal from its first prediction on."""
    from foc_ros.ros.endpoints import MOST_GOAL_TOPICS
    from foc_ros.ros.node import FocNode

    node = ros.add(FocNode(context=ros.context))

    def names(found: list[tuple[str, list[str]]]) -> set[str]:
        return {name.replace('/foc/', '~/') if name.startswith('/foc/') else name.removeprefix('/') for name, _ in found}

    goals = {f'~/goal_likelihood/goal{row}' for row in range(MOST_GOAL_TOPICS)}
    published = names(node.get_publisher_names_and_types_by_node('foc', '/')) | goals
    subscribed = names(node.get_subscriber_names_and_types_by_node('foc', '/'))
    services = names(node.get_service_names_and_types_by_node('foc', '/'))
    absolute = {'rosout', 'parameter_events', 'diagnostics', 'clock'}
    assert allowed('topics', 'publish') == {f'/{name}' if name in absolute else name for name in published}
    # the node subscribes to the clock if use_sim_time is set
    assert allowed('topics', 'subscribe') - {'/clock'} == {f'/{name}' if name in absolute else name for name in subscribed}
    assert allowed('services', 'reply') == services
    assert allowed('services', 'request') == set()
