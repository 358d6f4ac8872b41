# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording through the predictor: the same each time, nothing lost, every refusal counted."""

import contextlib
import io
import json
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bag_helpers import CONFIG, FRAME, TYPES, messages, ns, reach, write_bag, write_mcap, write_parameters
from message_helpers import marker, marker_array, read_columns, transform
from prediction_samples import predict_aside
from rosbags.highlevel import AnyReader

import foc_ros
from foc_ros.analysis.replay import GuidanceReplay, Replay, Step
from foc_ros.cli.main import main
from foc_ros.core.config import Config, replace_values
from foc_ros.core.guidance.guide import GuidanceStatus
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import HandSample
from foc_ros.io.bags import BagReader
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles

RECORDING = Path(__file__).parents[1] / 'foc_ros' / 'recordings' / 'reaching.mcap'
FEW = 0.12
"""Seconds of a reach that are enough for a few predictions."""
NAMES = 'label description goal sides status effort cost eta tau lambda likelihood qp_solves mean stddev'
HEIGHT_NAMES = ' height height_velocity height_stddev'


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('replay') / 'reach', messages(seconds=FEW))


@pytest.fixture(scope='module')
def answer(bag):
    return replay_json(bag)


def run(bag, *options, config=CONFIG):
    return main(['replay', str(bag), '--params', write_parameters(bag.parent, config), *options])


def replay_json(bag, *options):
    output, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        assert run(bag, '--json', *options) == 0
    assert errors.getvalue() == ''
    return json.loads(output.getvalue(), parse_constant=lambda name: pytest.fail(f'{name} is no JSON'))


def without_times(answer):
    return {**answer, 'summary': {name: value for name, value in answer['summary'].items() if name != 'prediction_ms'}}


def test_json_has_the_promised_names(answer):
    samples = len(reach(FEW))
    summary = answer['summary']
    counts = {name: summary[name] for name in ('samples', 'predictions', 'refused')}
    assert counts == {'samples': samples, 'predictions': samples, 'refused': {}}
    assert summary['duration_s'] == pytest.approx(FEW - 0.02 + 0.1)
    assert 0 < summary['prediction_ms']['p50'] <= summary['prediction_ms']['p99']
    assert [each['stamp_ns'] for each in answer['predictions']] == [ns(time) for time, _ in reach(FEW)]
    for prediction in answer['predictions']:
        solved = [each for each in prediction['candidates'] if each['status'] == 'solved']
        assert solved and sum(each['likelihood'] for each in solved) == pytest.approx(1 - prediction['other'])
        assert prediction['candidates'][0]['label'] == prediction['most_likely']
        for each in prediction['candidates']:
            assert ' '.join(each) == NAMES + (HEIGHT_NAMES if each['likelihood'] else '')
            assert each['goal'] == 0 and set(each['sides'].values()) <= {'left', 'right'}
            assert np.shape(each['mean']) == np.shape(each['stddev']) == (CONFIG.foc.steps + 1, 2)
        assert {each['sides']['7'] for each in solved} == {'left', 'right'}
        assert np.allclose([each['mean'][-1] for each in solved], [0.3, 0.0], atol=1e-6)


def test_the_same_answer_each_time_also_with_topics_by_type(tmp_path, bag, answer):
    names = {'/hand_pose': '/tool/pose', '/obstacles': '/perception/spheres', '/goals': '/targets'}
    renamed = write_bag(tmp_path / 'renamed', messages(seconds=FEW), names)
    for each in (bag, renamed):
        assert without_times(replay_json(each)) == without_times(answer)


def test_a_topic_can_be_chosen(tmp_path, answer, capsys):
    still = [('/left/measured_cp', stamp_ns, message) for topic, stamp_ns, message in messages(FEW) if topic == '/hand_pose'][:1]
    moving = [('/right/measured_cp' if each[0] == '/hand_pose' else each[0], *each[1:]) for each in messages(seconds=FEW)]
    arms = write_bag(tmp_path / 'arms', [*moving, *still])
    assert run(arms) == 2
    assert 'several topics could be hand_pose: /left/measured_cp, /right/measured_cp; choose with' in capsys.readouterr().err
    assert replay_json(arms, '--remap', 'hand_pose:=/right/measured_cp')['predictions'] == answer['predictions']


def test_what_cannot_be_used_is_counted_and_the_rest_goes_on(tmp_path):
    obstacles = [(0.15, 0.0, 0.0, 0.03, 0.002, 7), (float('inf'), 0, 0, 0.1, 0, 8)]
    bad = [
        ('/hand_pose', ns(0.01), encode_hand_pose(TYPES, ns(0.01), FRAME, (float('nan'), 0.0, 0.0))),
        ('/hand_pose', ns(0.03), encode_hand_pose(TYPES, ns(0.03), 'camera', (0.0, 0.0, 0.0))),
        ('/obstacles', ns(0.05), encode_obstacles(TYPES, ns(0.05), FRAME, [(0.1, 0.0, 0.0, -0.1, 0.0, 1)])),
        ('/obstacles', ns(0.07), encode_obstacles(TYPES, ns(0.07), FRAME, obstacles)),
        ('/hand_pose', ns(0.09), encode_hand_pose(TYPES, ns(0.02), FRAME, (0.0, 0.0, 0.0))),
    ]
    replayed = Replay(CONFIG)
    with BagReader(write_bag(tmp_path / 'bad', by_stamp(messages(seconds=FEW), bad))) as reader:
        stamps = [step.prediction.stamp_ns for step in replayed.steps(reader) if step.prediction]
    assert stamps == [ns(time) for time, _ in reach(FEW)]
    expected = {'hand_lost': 1, 'hand_wrong_frame': 1, 'obstacles_invalid': 1, 'hand_late': 1, 'obstacles_dropped_not_finite': 1}
    assert {name: replayed.intake.counts.get(name) for name in expected} == expected


def by_stamp(*given):
    return sorted(chain.from_iterable(given), key=lambda each: each[1])


def test_a_slash_before_a_frame_is_no_part_of_its_name(tmp_path):
    """As ROS 1 named frames; in any input, in a transform and in the parameter."""
    link = transform(TYPES, '/tool', (0.0, 0.0, 0.0), parent='/world')
    given = [('/tf_static', ns(-0.1), TYPES.make('tf2_msgs/msg/TFMessage', transforms=[link]))]
    for topic, stamp_ns, message in messages(seconds=FEW):
        if topic == '/hand_pose':
            message.header.frame_id = '/tool'
        given.append((topic, stamp_ns, message))
    bag, config = write_bag(tmp_path / 'slashes', given), replace_values(CONFIG, {'frame_id': '/world'})
    assert len(list(foc_ros.replay(bag, config))) == len(reach(FEW))


def test_a_hand_that_does_not_move_is_told(tmp_path, capsys):
    last = [(ns(0.2 + i / 10), encode_hand_pose(TYPES, ns(0.2 + i / 10), FRAME, (0.1, 0.0, 0.0))) for i in range(15)]
    bag = write_bag(tmp_path / 'frozen', [*messages(seconds=FEW), *(('/hand_pose', *each) for each in last)])
    assert run(bag, config=replace_values(CONFIG, {'rate_hz': 2.0})) == 0
    assert capsys.readouterr().err == 'foc_ros replay: the hand does not move: the same position for 1.4 s\n'


def test_transforms_and_markers_that_are_left_out_are_counted(tmp_path, capsys):
    array = marker_array(TYPES, *2 * [marker(TYPES, stamp_ns=ns(0), type=9)])
    tree = TYPES.make('tf2_msgs/msg/TFMessage', transforms=[transform(TYPES, 'base', (0.0, 0.0, 0.0), parent='base')])
    given = [('/tf', ns(-0.09), tree), ('/obstacle_markers', ns(-0.08), array)]
    assert run(write_bag(tmp_path / 'odd', by_stamp(messages(seconds=FEW), given))) == 0
    assert capsys.readouterr().err == (
        'foc_ros replay: 1 parts of tf left out (not_usable); 2 parts of obstacle_markers left out (not_a_shape)\n'
    )
    only = [each for each in messages(seconds=FEW) if each[0] != '/obstacles']
    assert run(write_bag(tmp_path / 'none', by_stamp(only, given))) == 3
    assert '2 parts of obstacle_markers left out (not_a_shape); no obstacles received' in capsys.readouterr().err


def test_a_scene_in_another_frame_than_the_first_pose_is_counted(tmp_path, capsys):
    given = [('/obstacle_markers', ns(-0.08), marker_array(TYPES, marker(TYPES, stamp_ns=ns(0), frame_id='camera')))]
    assert run(write_bag(tmp_path / 'odd', by_stamp(messages(seconds=FEW), given))) == 0
    told = '1 messages before the first hand pose left out: they are in another frame than it'
    assert capsys.readouterr().err == f'foc_ros replay: {told}\n'


def test_nothing_solved_is_exit_3_and_says_why(tmp_path, capsys):
    stale = [each for each in messages(seconds=FEW) if each[0] == '/hand_pose']
    stale += [
        ('/obstacles', ns(-1), encode_obstacles(TYPES, ns(-4.5), FRAME, [])),
        ('/goals', ns(-1), encode_goals(TYPES, ns(-1), FRAME, np.zeros((1, 3)))),
    ]
    assert run(write_bag(tmp_path / 'stale', by_stamp(stale))) == 3
    out, err = capsys.readouterr()
    assert 'predictions' in out
    assert err.startswith('foc_ros replay: no prediction has a solved candidate: obstacles are 4.6 s older')
    assert err.count('\n') == 1


def test_the_output_bag_holds_inputs_and_predictions_also_for_an_independent_reader(tmp_path, bag, answer):
    """The mcap library and its ROS 2 decoder share no code with the writer."""
    assert run(bag, '--output', str(tmp_path / 'out')) == 0
    with BagReader(bag) as before, BagReader(tmp_path / 'out') as after:
        inputs, again = ([(item.topic, item.log_ns, bytes(item.raw)) for item in each] for each in (before, after))
        assert inputs == again
    assert without_times(replay_json(tmp_path / 'out')) == without_times(answer)
    mcap_reader = pytest.importorskip('mcap.reader', reason='the mcap library is not installed')
    mcap_decoder = pytest.importorskip('mcap_ros2.decoder', reason='mcap-ros2-support is not installed')
    found: dict[str, list[Any]] = {}
    with (tmp_path / 'out' / 'out.mcap').open('rb') as stream:
        reader = mcap_reader.make_reader(stream, decoder_factories=[mcap_decoder.DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert message.log_time > 0
            found.setdefault(channel.topic, []).append(decoded)
    poses, outputs = len(reach(FEW)), ('prediction', 'likelihoods', 'likelihoods_by_name', 'path', 'markers')
    inputs = {'/hand_pose': poses, '/obstacles': 2, '/goals': 2}
    assert {topic: len(each) for topic, each in found.items()} == inputs | {f'/foc/{name}': poses for name in outputs}
    information = yaml.safe_load((tmp_path / 'out' / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert (information['version'], information['storage_identifier']) == (9, 'mcap')
    assert (information['message_count'], information['relative_file_paths']) == (sum(map(len, found.values())), ['out.mcap'])
    for prediction, cloud in zip(foc_ros.replay(bag, CONFIG), found['/foc/prediction'], strict=True):
        table, first = read_columns(cloud), next(each for each in prediction if each.label == prediction.most_likely)
        assert np.allclose(table['x'][table['candidate'] == 0], first.mean[:, 0], atol=1e-6)
        assert np.allclose(table['likelihood'][table['candidate'] == 0], first.likelihood)


def test_a_damaged_recording_leaves_neither_json_nor_output(tmp_path, capsys):
    file = tmp_path / 'damaged.mcap'
    ends = write_mcap(file, messages(seconds=FEW), per_chunk=5)
    data = bytearray(file.read_bytes())
    place = data.rindex(b'\x28\xb5\x2f\xfd', 0, ends[1])  # the last chunk's messages, after those of others are replayed
    data[place + 20 : place + 40] = bytes(20)
    file.write_bytes(data)
    assert run(file, '--json', '--output', str(tmp_path / 'out')) == 2
    out, err = capsys.readouterr()
    assert out == '' and 'damaged or cut short' in err and not (tmp_path / 'out').exists()


def test_a_table_is_printed_and_a_report_is_written(tmp_path, bag, capsys):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    assert run(bag, '--report', str(tmp_path / 'report')) == 0
    out, err = capsys.readouterr()
    assert 'hand poses' in out and f'{len(reach(FEW))} with a solved candidate' in out and err == ''
    assert out.endswith(f'\nreport: file://{tmp_path}/report/index.html\n')
    page = (tmp_path / 'report' / 'index.html').read_text('utf-8')
    assert 'reach' in page and 'hand poses' in page


def camera_at(y, seconds, late_s=0.02):
    """Return a transform for a time that is logged later: a camera at (0, y) that looks along the y axis of the world."""
    stamped = transform(TYPES, 'camera', (0.0, y, 0.0), (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)), ns(seconds))
    return '/tf', ns(seconds + late_s), TYPES.make('tf2_msgs/msg/TFMessage', transforms=[stamped])


def seen_by_camera(items):
    """Return messages with the obstacle in the frame of a camera that moves by 0.1 m/s."""
    moved = []
    for topic, log_ns, message in items:
        if topic == '/obstacles':
            y = 0.1 * (log_ns - ns(0.0)) * 1e-9
            message = encode_obstacles(TYPES, log_ns, 'camera', [(-y, -0.15, 0.0, 0.03, 0.002, 7)])
        moved.append((topic, log_ns, message))
    return moved


def test_the_transforms_of_a_recording_are_applied(tmp_path, capsys):
    """A camera on a moving arm, whose transforms are logged after the obstacles that need them; the goals are in the world."""
    transforms = [camera_at(0.1 * seconds, seconds) for seconds in np.arange(-0.2, 0.3, 0.05)]
    items = by_stamp(seen_by_camera(messages(0.24)), transforms)
    config = replace_values(CONFIG, {'frame_id': FRAME})
    bag, still = write_bag(tmp_path / 'moving', items), write_bag(tmp_path / 'still', messages(0.24))
    moving = list(foc_ros.replay(bag, config))
    assert len(moving) == len(reach(0.24))
    same = {each.stamp_ns: each for each in foc_ros.replay(still, config)}
    for prediction in moving[2:]:
        (obstacle,), (expected,) = (each.obstacles.centre for each in (prediction, same[prediction.stamp_ns]))
        np.testing.assert_allclose(obstacle, expected, atol=1e-6)
    assert run(bag, '--output', str(tmp_path / 'out'), config=config) == 0
    with BagReader(tmp_path / 'out') as reader:
        assert sum(item.role == 'tf' for item in reader) == len(transforms)
    assert 'transform_newest' not in capsys.readouterr().out


def test_a_hand_that_waits_for_a_transform_meets_the_scene_that_waits_with_it(tmp_path):
    """Obstacles and hand are seen by one camera, the hand first; each transform is logged after both."""

    def see_hand(seconds):
        return '/hand_pose', ns(seconds), encode_hand_pose(TYPES, ns(seconds), 'camera', np.zeros(3))

    goals, places = encode_goals(TYPES, ns(0.0), FRAME, np.array([[0.3, 0.0, 0.0]])), {0.02: 0.15, 0.04: 0.16, 0.06: 0.17}
    items = [('/goals', ns(0.0), goals), see_hand(0.0)]
    for now, x in places.items():
        seen = encode_obstacles(TYPES, ns(now), 'camera', [(-0.1, -x, 0.0, 0.03, 0.002, 7)])
        items += [('/obstacles', ns(now), seen), see_hand(now + 0.001), camera_at(0.0, now + 0.002, 0.003)]
    bag = write_bag(tmp_path / 'both', [camera_at(0.0, 0.0, -0.01), *items])
    made = list(foc_ros.replay(bag, replace_values(CONFIG, {'frame_id': FRAME})))
    np.testing.assert_allclose([each.obstacles.centre[0] for each in made], [[x, -0.1] for x in places.values()], atol=1e-9)


def test_what_was_refused_is_named(tmp_path, capsys):
    count = sum(topic == '/obstacles' for topic, _, _ in messages(0.24))
    bag = write_bag(tmp_path / 'blind', seen_by_camera(messages(0.24)))
    assert run(bag, config=replace_values(CONFIG, {'frame_id': FRAME})) == 3
    line = capsys.readouterr().err.splitlines()[-1]
    assert f'{count} of {count} messages of obstacles refused' in line
    assert "expected the working frame 'world', got 'camera'; no transform to world: camera and world are not connected" in line


def test_guidance_of_a_recording_takes_no_jump_for_work():
    config = Config().with_values({'guidance.clearance': 0.0})
    pipeline = Pipeline(config)
    guidance, outputs = GuidanceReplay(pipeline), []
    for tick in range(40):
        sample = HandSample(round(10**9 + 10**7 * tick), np.array([0.0, 0.0 if tick < 20 else 0.4]))
        pipeline.add_hand_sample(sample)
        predicted = predict_aside(stamp_ns=sample.stamp_ns) if tick < 20 else None
        outputs += guidance.add(Step(None, sample, predicted, pipeline.scene))
    assert max(output.force[1] for _, output, _ in outputs) > 2.0
    assert min(output.tank for _, output, _ in outputs) > 0.4
    assert outputs[-1][1].status is GuidanceStatus.NO_PREDICTION
    later = HandSample(3 * 10**18, np.zeros(2))  # a century: while nothing is guided, nothing is updated
    pipeline.add_hand_sample(later)
    assert len(guidance.add(Step(None, later, None, pipeline.scene))) < 100


def test_guidance_is_the_same_each_time(tmp_path, capsys):
    """In the first 3 s of the packaged recording."""
    values = {'rate_hz': 2.0, 'foc.steps': 20, 'homotopy.max_candidates': 2}
    values |= {'guidance.clearance': 0.0, 'guidance.rate_hz': 25.0, 'guidance.hold_s': 1.0}
    parameters, out = write_parameters(tmp_path, replace_values(Config(), values)), tmp_path / 'out'
    with BagReader(RECORDING) as reader:
        items = [(item.topic, item.log_ns, item.message) for item in reader]
    bag = write_bag(tmp_path / 'bag', [each for each in items if each[1] < items[0][1] + 3 * 10**9])

    def run(*options):
        assert main(['replay', str(bag), '--params', parameters, '--json', *options]) == 0
        return json.loads(capsys.readouterr().out)

    answer, plain = run('--guidance', '--output', str(out)), run()
    guidance = answer['guidance']
    assert guidance == run('--guidance')['guidance']
    assert 'guidance' not in plain
    assert [each['most_likely'] for each in plain['predictions']] == [each['most_likely'] for each in answer['predictions']]
    assert {later['stamp_ns'] - each['stamp_ns'] for each, later in pairwise(guidance)} == {40_000_000}
    assert any(np.hypot(*each['force']) > 0.0 for each in guidance)
    with AnyReader([out]) as reader:
        counts = {each.topic: each.msgcount for each in reader.connections}
    assert {counts[f'/foc/guidance/{name}'] for name in ('wrench', 'reference', 'stiffness')} == {len(guidance)}
    with BagReader(out) as reader:
        assert sorted(reader.roles) == ['goals', 'hand_pose', 'obstacles'], 'its outputs are taken for no input'
