# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The RViz configuration and the Foxglove layout can be parsed and show topics of the node with their types."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from foc_ros.io import topics
from foc_ros.ros.messages.encode_prediction import LIKELIHOOD_COLUMNS, OUTPUTS

CONFIG = Path(__file__).parents[1] / 'config'
TYPES = {f'/{name}': kind for name, kind in topics.TYPES.items()} | {f'/foc/{name}': kind for name, (kind, _) in OUTPUTS.items()}
SHOWN = {
    'MarkerArray': 'MarkerArray',
    'PointCloud2': 'PointCloud2',
    'Path': 'Path',
    'Pose': 'PoseStamped',
    'PoseArray': 'PoseArray',
}


def rviz() -> Any:
    return yaml.safe_load((CONFIG / 'foc.rviz').read_text('utf-8'))['Visualization Manager']


def foxglove() -> Any:
    return json.loads((CONFIG / 'foxglove.json').read_text('utf-8'))


def test_rviz_shows_every_output_it_can_display() -> None:
    shown = {}
    for display in rviz()['Displays']:
        if 'Topic' in display:
            shown[display['Topic']['Value']] = SHOWN[display['Class'].split('/')[1]]
    assert {'/foc/prediction', '/foc/path', '/foc/markers', '/hand_pose', '/goals'} == set(shown)
    assert all(TYPES[topic].endswith(f'/{kind}') for topic, kind in shown.items())
    cloud = next(each for each in rviz()['Displays'] if each['Class'].endswith('/PointCloud2'))
    assert cloud['Channel Name'] == 'likelihood'


def leaves(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        for side in ('first', 'second'):
            yield from leaves(layout[side])


def test_foxglove_shows_topics_of_the_node_in_its_panels() -> None:
    layout = foxglove()
    assert set(leaves(layout['layout'])) == set(layout['configById'])
    scene = layout['configById']['3D!foc']
    assert {'/foc/prediction', '/foc/path', '/foc/markers'} <= set(scene['topics']) <= set(TYPES)
    assert scene['topics']['/foc/prediction']['colorField'] == 'likelihood'
    assert TYPES[scene['publish']['poseTopic']] == 'geometry_msgs/msg/PoseStamped'
    for i, line in enumerate(layout['configById']['Plot!likelihoods']['paths']):
        assert line['value'] == f'/foc/likelihoods.data[{i * len(LIKELIHOOD_COLUMNS)}]'


def test_the_drawing_has_every_display_in_the_view_of_the_configuration() -> None:
    """`scripts/viewers.py` draws the messages of the node: lines, ellipses and labels, and the range that the view shows."""
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    from message_helpers import message_types, pose_array, pose_stamped
    from prediction_samples import three_ways
    from test_readme_picture import script

    from foc_ros.ros.messages.encode_prediction import encode_outputs

    bags = message_types('rosbags')
    messages = {f'/foc/{name}': message for name, message in encode_outputs(three_ways(), 'xy', bags).items()}
    messages |= {'/hand_pose': pose_stamped(bags, (0.0, 0.0, 0.0)), '/goals': pose_array(bags, [(0.3, 0.0, 0.0)])}
    configuration = {'Visualization Manager': rviz(), 'Window Geometry': {'Width': 1200, 'Height': 900}}
    (axes,) = script('viewers').draw(configuration, messages).axes
    assert axes.get_xlim() == pytest.approx((0.15 - 0.4, 0.15 + 0.4))
    assert axes.get_ylim() == pytest.approx((-0.3, 0.3))
    markers = messages['/foc/markers'].markers
    labels = [each.text for each in markers if each.type == 9]
    assert [each.get_text() for each in axes.texts if each.get_text()] == labels
    arms = 2 + 1
    assert len(axes.texts) == len(labels) + arms, 'two axes of the hand, one arrow of the goal'
    assert len(axes.patches) == sum(each.type == 3 for each in markers)
    (dots,) = axes.collections
    assert len(dots.get_offsets()) == messages['/foc/prediction'].width
