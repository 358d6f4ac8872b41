# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The RViz configuration and the Foxglove layout can be parsed and show topics of the node with their types."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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
