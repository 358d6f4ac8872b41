"""Recordings of a scene change likelihoods and positions where they agree with the scene and the hand, and nothing elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from test_demonstrations import GOAL, OBSTACLES, bow

from foc_ros.cli.main import main
from foc_ros.core.config import Config, ExperienceConfig
from foc_ros.core.errors import InputError
from foc_ros.core.experience import NO_LIBRARY, find_evidence, make_library
from foc_ros.core.homotopy.demonstrations import record_demonstration
from foc_ros.core.memory import Memory
from foc_ros.core.predictor import predict
from foc_ros.core.types import HandState
from foc_ros.io.class_library import load_library, save_library

CONFIG = Config().with_values({'foc.steps': 20})
TIMES_S = np.linspace(0.0, 2.0, 40)
ABOVE = record_demonstration('world', bow(0.03), OBSTACLES, TIMES_S)
HAND = HandState(1, np.zeros(6), 1e-6 * np.eye(6), frame_id='world')


def ask(library, hand=HAND, obstacles=OBSTACLES):
    return predict(CONFIG, hand, obstacles, GOAL, Memory(), library)[0]


def by_label(prediction):
    return {each.label: each for each in prediction.candidates}


def sides_of(recording):
    return dict(zip(recording.ids, recording.sides, strict=True))


def test_likelihoods_are_those_of_a_dirichlet_distribution():
    before, after = by_label(ask(NO_LIBRARY)), by_label(ask(make_library([ABOVE, ABOVE])))
    taken = [label for label, each in before.items() if dict(each.candidate.sides).items() <= sides_of(ABOVE).items()]
    assert len(taken) == 1
    prior, count = CONFIG.experience.prior_count, 2.0
    for label, each in before.items():
        if each.has_likelihood:
            expected = (prior * each.likelihood + count * (label in taken)) / (prior + count)
            assert after[label].likelihood == pytest.approx(expected, abs=1e-9)


def test_paths_stay_those_of_the_model():
    known, model = by_label(ask(make_library([ABOVE] * 20))), by_label(ask(NO_LIBRARY))
    for label, each in model.items():
        np.testing.assert_array_equal(known[label].mean, each.mean)
        np.testing.assert_array_equal(known[label].covariance, each.covariance)


@pytest.mark.parametrize(
    'library',
    [
        [],
        [replace(ABOVE, times_s=None)],
        [replace(ABOVE, frame_id='elsewhere')],
        [replace(ABOVE, centre=ABOVE.centre + 0.03)],
        [replace(ABOVE, path=ABOVE.path + np.array([0.0, 1.0]))],
    ],
    ids=['none', 'without times', 'another frame', 'obstacles moved', 'far from the hand'],
)
def test_without_a_recording_that_agrees_it_is_the_model(library):
    known, model = ask(make_library(library)), ask(NO_LIBRARY)
    for one, other in zip(known.candidates, model.candidates, strict=True):
        assert one.label == other.label and one.likelihood == other.likelihood
        np.testing.assert_array_equal(one.mean, other.mean)
        np.testing.assert_array_equal(one.covariance, other.covariance)


def test_equal_input_gives_equal_answers():
    one, other = (ask(make_library([ABOVE])) for _ in range(2))
    for each, same in zip(one.candidates, other.candidates, strict=True):
        assert each.likelihood == same.likelihood
        np.testing.assert_array_equal(each.mean, same.mean)


def test_a_velocity_excludes_recordings_only_while_the_hand_moves():
    library, settings = make_library([ABOVE]), ExperienceConfig()
    away = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    moving = HandState(1, away, np.eye(6), frame_id='world', onset_ns=0)
    assert not len(find_evidence(library, moving, OBSTACLES, settings).row)
    assert find_evidence(library, HAND, OBSTACLES, settings).weight == pytest.approx([1.0])


def test_times_are_read_as_they_were_written(tmp_path):
    save_library(tmp_path / 'ways.json', [ABOVE, replace(ABOVE, times_s=None)])
    timed, plain = load_library(str(tmp_path / 'ways.json'))
    np.testing.assert_array_equal(timed.times_s, ABOVE.times_s)
    assert plain.times_s is None


@pytest.mark.parametrize('times', ['[0]', '1', f'[{"0, " * 64}-1]', f'[{"0, " * 64}"x"]'])
def test_wrong_times_name_the_field(tmp_path, times, capsys):
    file = tmp_path / 'ways.json'
    save_library(file, [ABOVE])
    text = file.read_text()
    file.write_text(text[: text.index('"times_s": ') + 11] + times + '}]}')
    with pytest.raises(InputError, match=r'ways\[0\]\.times_s'):
        load_library(str(file))


HEADS = {'goals.csv': 'goal,x_m,y_m\n0,0.3,0.0\n', 'obstacles.csv': 'obstacle,x_m,y_m,radius_m\na,0.15,0.0,0.015\n'}


def write_tables(folder, ends):
    for name, text in HEADS.items():
        (folder / name).write_text(text)
    rows = [
        f'r{k},{0.02 * t:.3f},{end * t / 50:.5f},{0.03 * np.sin(np.pi * t / 50):.5f}'
        for k, end in enumerate(ends)
        for t in range(51)
    ]
    (folder / 'recordings.csv').write_text('recording,t_s,x_m,y_m\n' + '\n'.join(rows) + '\n')


def test_learn_writes_a_library_of_recordings(tmp_path):
    write_tables(tmp_path, [0.3, 0.3])
    assert main(['learn', str(tmp_path), '--output', str(tmp_path / 'ways.json')]) == 0
    recordings = load_library(str(tmp_path / 'ways.json'))
    assert len(recordings) == 2
    assert all(0.5 < each.times_s[-1] < 1.5 and (np.diff(each.times_s) > 0.0).all() for each in recordings)


def test_a_recording_that_does_not_reach_its_goal_is_named(tmp_path, capsys):
    write_tables(tmp_path, [0.3, 0.1])
    assert main(['learn', str(tmp_path), '--output', str(tmp_path / 'ways.json')]) == 2
    assert 'r1: expected a movement' in capsys.readouterr().err
    assert len(load_library(str(tmp_path / 'ways.json'))) == 1
