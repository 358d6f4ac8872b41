# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""CSV tables to bags: every number arrives, and every wrong cell is named."""

import numpy as np
import pytest
from message_helpers import read_columns

from foc_ros.analysis.recordings import read_tables
from foc_ros.cli.main import main
from foc_ros.core.errors import RecordingError
from foc_ros.io.bags import BagReader
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud

RECORDINGS = 'recording,t_s,x_m,y_m\na,0.0,0.1,0.2\na,0.5,0.3,0.4\na,1.2,0.5,0.6\nb,3.25,-1,2e-3\n'
OBSTACLES = 'name,x_m,y_m,radius_m\nleft,0.5,-0.1,0.03\nright,0.425,0.08,0.025\n'
GOALS = 'goal,x_m,y_m\n0,0.28,0.35\n1,0.42,0.35\n'


def convert(folder, recordings=RECORDINGS, obstacles=OBSTACLES, goals=GOALS):
    arguments = ['convert', str(folder / 'r.csv'), '--obstacles', str(folder / 'o.csv'), '--output', str(folder / 'bags')]
    (folder / 'r.csv').write_text(recordings, 'utf-8')
    (folder / 'o.csv').write_text(obstacles, 'utf-8')
    if goals is not None:
        (folder / 'g.csv').write_text(goals, 'utf-8')
        arguments += ['--goals', str(folder / 'g.csv')]
    return main(arguments)


def read(folder, name):
    """Return the newest message of each input in a bag that was made."""
    with BagReader(folder / 'bags' / name) as reader:
        return {item.role: item.message for item in reader}


def rows(message):
    return np.column_stack([*read_columns(message).values()])


def test_every_number_arrives(tmp_path, capsys):
    assert convert(tmp_path) == 0
    assert capsys.readouterr().out.startswith('2 bags with 4 hand poses and 2 obstacles written to ')
    assert sorted(each.name for each in (tmp_path / 'bags').iterdir()) == ['a', 'b']
    with BagReader(tmp_path / 'bags' / 'a') as reader:
        items = list(reader)
    hands = [item for item in items if item.role == 'hand_pose']
    assert [item.log_ns for item in hands] == [1_000_000_000, 1_500_000_000, 2_200_000_000]
    stamps = [item.message.header.stamp for item in hands]
    assert [stamp.sec * 10**9 + stamp.nanosec for stamp in stamps] == [item.log_ns for item in hands]
    poses = [(each.position.x, each.position.y, each.position.z, each.orientation.w) for each in (i.message.pose for i in hands)]
    assert poses == [(0.1, 0.2, 0.0, 1.0), (0.3, 0.4, 0.0, 1.0), (0.5, 0.6, 0.0, 1.0)]
    assert {item.message.header.frame_id for item in items} == {'world'}
    goals = next(item.message.poses for item in items if item.role == 'goals')
    assert [(each.position.x, each.position.y) for each in goals] == [(0.28, 0.35), (0.42, 0.35)]
    obstacles = next(item.message for item in items if item.role == 'obstacles')
    assert np.allclose(rows(obstacles), [(0.5, -0.1, 0, 0.03, 0, 0), (0.425, 0.08, 0, 0.025, 0, 1)])


def test_heights_deviations_ids_and_boxes_are_optional_columns(tmp_path):
    obstacles = 'id,x_m,y_m,radius_m,radius_stddev_m,z_m\n7,0.5,-0.1,0.03,0.002,0.1\n-2,0,0,0,0,0\n'
    assert convert(tmp_path, 'recording,t_s,x_m,y_m,z_m\n1,0,0.1,0.2,0.3\n', obstacles, 'x_m,y_m,z_m\n0.1,0.2,0.4\n') == 0
    items = read(tmp_path, '1')
    assert (items['hand_pose'].pose.position.z, items['goals'].poses[0].position.z) == (0.3, 0.4)
    assert np.allclose(rows(items['obstacles']), [(0.5, -0.1, 0.1, 0.03, 0.002, 7), (0.0, 0.0, 0.0, 0.0, 0.0, -2)])
    boxes = 'x_m,y_m,radius_m,size_x_m,size_y_m,yaw_rad\n0.5,-0.1,0,0.2,0.1,0.3\n0.6,0.1,0.02,0,0,0\n'
    (tmp_path / 'boxes').mkdir()
    assert convert(tmp_path / 'boxes', obstacles=boxes) == 0
    message = read(tmp_path / 'boxes', 'a')['obstacles']
    assert np.allclose(rows(message), [(0.5, -0.1, 0, 0, 0, 0, 0.2, 0.1, 0.3), (0.6, 0.1, 0, 0.02, 0, 1, 0, 0, 0)])
    assert decode_point_cloud(message, 'xy').obstacles.corners.tolist() == [4, 1]


def test_each_recording_has_its_own_scene(tmp_path, capsys):
    obstacles = 'recording,x_m,y_m,radius_m\na,0.5,-0.1,0.03\nb,0.1,0,0.01\na,0.6,0,0.02\n'
    assert convert(tmp_path, obstacles=obstacles, goals='recording,x_m,y_m\nb,1,0\na,2,0\na,3,0\n') == 0
    assert '2 bags with 4 hand poses and 1 to 2 obstacles written' in capsys.readouterr().out
    for name, expected, goals in (('a', [(0.03, 0), (0.02, 1)], [2, 3]), ('b', [(0.01, 0)], [1])):
        items = read(tmp_path, name)
        assert np.allclose(rows(items['obstacles'])[:, [3, 5]], expected)
        assert [pose.position.x for pose in items['goals'].poses] == goals


def test_a_table_needs_obstacles_beside_it(tmp_path, capsys):
    (tmp_path / 'r.csv').write_text(RECORDINGS, 'utf-8')
    assert main(['convert', str(tmp_path / 'r.csv'), '--output', str(tmp_path / 'bags')]) == 2
    assert '--obstacles: expected a table of obstacles, which may be without rows, got nothing' in capsys.readouterr().err


def test_without_goals_the_bag_has_none_and_names_of_bags_are_safe(tmp_path):
    assert convert(tmp_path, 'recording,t_s,x_m,y_m\n../up,0,0,0\nüb er,0,0,0\n..,0,0,0\n', goals=None) == 0
    assert sorted(each.name for each in (tmp_path / 'bags').iterdir()) == ['_', '_b_er', '_up']
    with pytest.raises(RecordingError, match='no topic for goals'), BagReader(tmp_path / 'bags' / '_'):
        pass


def test_an_existing_bag_stops_before_anything_is_written(tmp_path, capsys):
    (tmp_path / 'bags' / 'b').mkdir(parents=True)
    assert convert(tmp_path) == 2
    assert 'exists already and is not overwritten' in capsys.readouterr().err
    assert [each.name for each in (tmp_path / 'bags').iterdir()] == ['b']


@pytest.mark.parametrize(
    ('which', 'text', 'message'),
    [
        ('recordings', 'recording,t_s,x_m\na,0,0\n', 'r.csv: row 1: no column y_m; it has recording, t_s, x_m'),
        ('recordings', 'recording:t_s:x_m:y_m\na:0:0:0\n', 'r.csv: row 1: no column recording, t_s, x_m, y_m'),
        ('recordings', 'recording,t_s,x_m,y_m,y_m\na,0,0,0,0\n', 'r.csv: row 1: a column is named twice'),
        ('recordings', '', 'r.csv: the file is empty: expected columns recording, t_s, x_m, y_m'),
        ('recordings', 'recording,t_s,x_m,y_m\n', 'r.csv: expected at least one row, got none'),
        ('rows', 'a,0,0,0\na,1,0', 'r.csv: row 3: expected 4 cells, got 3'),
        ('rows', 'a,0,0,0\na,1,nan,0', "r.csv: row 3, column x_m: expected a number in [-10000, 10000], got 'nan'"),
        ('rows', 'a,x,0,0', "row 2, column t_s: expected a number in [0, 2000000000], got 'x'"),
        ('rows', 'a,1.5,0,0\na,1.4,0,0', "row 3, column t_s: expected a number in [1.5, 86401.5], got '1.4'"),
        ('rows', 'a,0,0,0\na,1e9,0,0', "row 3, column t_s: expected a number in [0, 86400], got '1e9'"),
        ('rows', ',0,0,0', "row 2, column recording: expected a name, got ''"),
        ('rows', 'a b,0,0,0\na_b,0,0,0', "recordings 'a b' and 'a_b' would both be written to a_b"),
        ('rows', '"a,0,0,0', 'r.csv: not a CSV table'),
        ('obstacles', 'x_m,y_m\n0,0\n', 'o.csv: row 1: no column radius_m'),
        ('obstacles', 'x_m,y_m,size_x_m,size_y_m\n0,0,0,0\n', "row 2, column size_x_m: expected a size or a radius > 0, got '0'"),
        ('obstacles', 'x_m,y_m,size_x_m,size_y_m,yaw_rad\n0,0,1,1,nan\n', 'yaw_rad: expected a number in [-10000, 10000]'),
        ('goals', 'recording,x_m,y_m\nb,0,0\n', "recording 'a': the table of goals has no row for it"),
        ('obstacles', 'x_m,y_m,radius_m\n0,0,-0.1\n', "radius_m: expected a number in [0, 10000], got '-0.1'"),
        ('obstacles', 'x_m,y_m,radius_m,id\n0,0,1,1.5\n', "expected a whole number in [-2147483648, 2147483647], got '1.5'"),
        ('obstacles', 'x_m,y_m,radius_m,id\n0,0,1,3\n0,0,1,3\n', 'row 3, column id: expected another id than the rows above'),
        ('obstacles', 'x_m,y_m,radius_m,id\n0,0,1,cup\n', "expected a whole number in [-2147483648, 2147483647], got 'cup'"),
        ('obstacles', 'x_m,y_m,radius_m\n' + 20_001 * '0,0,1\n', 'o.csv: expected at most 20,000 rows, got more'),
        ('goals', 'x_m,y_m\n' + 257 * '0,0\n', 'g.csv: expected at most 256 rows, got more'),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(tmp_path, capsys, which, text, message):
    tables = {'recordings': f'recording,t_s,x_m,y_m\n{text}\n'} if which == 'rows' else {which: text}
    assert convert(tmp_path, **tables) == 2
    error = capsys.readouterr().err
    assert error.startswith('foc_ros convert: ') and message in error and error.count('\n') == 1
    assert not (tmp_path / 'bags').exists()


def test_all_errors_of_a_table_are_found_at_once(tmp_path, capsys):
    recordings = 'recording,t_s,x_m,y_m\na,0,x,y\na,1,0\na,2,0,0\na,1,0,0\n'
    obstacles = 'x_m,y_m,radius_m,id\n0,0,-1,0\n0,a,1,1\n0,0,1,1\n0,0,1,1\n'
    for tables, places in (
        ({'recordings': recordings}, ['row 3', 'row 2, column x_m', 'row 2, column y_m', 'row 5, column t_s']),
        ({'obstacles': obstacles}, ['row 2, column radius_m', 'row 3, column y_m', 'row 5, column id']),
    ):
        assert convert(tmp_path, **tables) == 2
        lines = capsys.readouterr().err.splitlines()
        assert [line.partition('.csv: ')[2].partition(':')[0] for line in lines] == places


def write_folder(folder, separator=',', comma=False, seconds=1.0, metres=1.0):
    """A reach of 0.3 m in 1 s in other units, with another separator and with decimal commas."""
    times = np.arange(0.0, 1.0, 0.02)
    rows = [['recording', 't_s', 'x_m', 'y_m']]
    rows += [['a, b' if comma else 'a', *(f'{x:.9f}' for x in (t * seconds, 0.3 * metres * t**2, 0.0))] for t in times]
    tables = {'recordings': rows, 'goals': [['x_m', 'y_m'], ['0.3', '0.0']], 'obstacles': [['x_m', 'y_m', 'radius_m']]}
    folder.mkdir()
    for name, table_rows in tables.items():
        lines = [separator.join(each.replace('.', ',') if comma else each for each in row) for row in table_rows]
        (folder / f'{name}.csv').write_text('\n'.join(lines) + '\n')
    return folder


@pytest.mark.parametrize(
    ('units', 'words'),
    [
        ({'seconds': 1e3}, 't_s of recording a seems to be in ms: the median time between two poses is 20 s'),
        ({'seconds': 1 / 3600}, 't_s of recording a seems to be in h: the median time between two poses is 5.56e-06 s'),
        ({'seconds': 1 / 86400}, 't_s of recording a seems to be in days: the median time between two poses is 2.31e-07 s'),
        ({'metres': 1e3}, 'the position of recording a seems to be in mm: the hand moves at 576 m/s'),
        ({'metres': 1e2}, 'the position of recording a seems to be in cm: the hand moves at 57.6 m/s'),
        ({}, ''),
        # beyond a bound, the doubt is told before it
        ({'seconds': 1e6}, 't_s of recording a seems to be in us: the median time between two poses is 2e+04 s'),
        ({'seconds': 1e9}, 't_s of recording a seems to be in ns: the median time between two poses is 2e+07 s'),
        ({'metres': 1e6}, 'the position of recording a seems to be in um: the hand moves at 5.76e+05 m/s'),
    ],
)
def test_units_that_cannot_be_right_are_named(tmp_path, capsys, units, words):
    folder = write_folder(tmp_path / 'tables', **units)
    is_within_bounds = max(units.values(), default=1.0) <= 1e3
    single = [str(folder / 'recordings.csv'), '--obstacles', str(folder / 'obstacles.csv')]
    for number, arguments in enumerate(([str(folder)], single)):
        code = main(['convert', *arguments, '--output', str(tmp_path / f'bags{number}')])
        told, *bounds = capsys.readouterr().err.splitlines() or ['']
        assert told == (f'foc_ros convert: {folder / "recordings.csv"}: {words}' if words else '')
        assert (code, bool(bounds)) == ((0, False) if is_within_bounds else (2, True))
        assert all('expected a number in [' in each for each in bounds)


NEAR, FAR = 'x_m,y_m\n0.3,0\n', 'the {} of recording a seem to be in {}: the nearest is {} m from the movement of the hand'
LARGE = 'the sizes of the obstacles of recording a seem to be in mm: the smallest is 30 m'


@pytest.mark.parametrize(
    ('goals', 'obstacles', 'told'),
    [
        ('x_m,y_m\n320,0\n500,100\n', '320,0,10', [FAR.format(kind, 'mm', 320) for kind in ('goals', 'obstacles')]),
        ('x_m,y_m\n32,0\n50,10\n', '32,0,1', [FAR.format(kind, 'cm', 31.7) for kind in ('goals', 'obstacles')]),
        (NEAR, '0.2,0,30', [LARGE]),
        (NEAR, '0.2,0,30\n0.1,0.1,0.02', []),
        (NEAR, '0.2,0,0.9', []),
    ],
)
def test_scenes_that_cannot_be_in_metres_are_named(tmp_path, capsys, goals, obstacles, told):
    folder = write_folder(tmp_path / 'tables')
    (folder / 'goals.csv').write_text(goals)
    (folder / 'obstacles.csv').write_text(f'x_m,y_m,radius_m\n{obstacles}\n')
    single = [str(folder / f'{name}.csv') for name in ('recordings', 'obstacles', 'goals')]
    for arguments in ([str(folder)], [single[0], '--obstacles', single[1], '--goals', single[2]]):
        assert main(['convert', *arguments, '--output', str(tmp_path / f'bags{len(arguments)}')]) == 0
        assert capsys.readouterr().err.splitlines() == [f'foc_ros convert: {arguments[0]}: {words}' for words in told]


def test_times_that_repeat_are_named(tmp_path, capsys):
    rows = '\n'.join(f'a,{0.02 * (i // 2):.2f},{0.001 * i},0' for i in range(20))
    assert convert(tmp_path, recordings=f'recording,t_s,x_m,y_m\n{rows}\n') == 0
    assert 't_s of recording a repeats: 10 of 19 rows have the time of the row before' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('separator', 'comma', 'change'),
    [
        ('|', False, str),
        (' ', False, str),
        (';', True, str),
        ('\t', True, str),
        pytest.param(';', True, lambda text: 'sep=;\n\n' + text, id='the name of the separator and an empty line'),
        pytest.param(',', False, lambda text: text.replace('\n', ',,\n'), id='empty columns of a spreadsheet'),
    ],
)
def test_other_separators_and_decimal_commas_are_read(tmp_path, separator, comma, change):
    usual = read_tables(write_folder(tmp_path / 'usual'))['a']
    folder = write_folder(tmp_path / 'other', separator, comma)
    for file in folder.iterdir():
        file.write_text(change(file.read_text()))
    (movement,) = read_tables(folder).values()
    assert movement.name == ('a, b' if comma else 'a')
    assert movement.stamps_ns == usual.stamps_ns and np.array_equal(movement.positions, usual.positions)
