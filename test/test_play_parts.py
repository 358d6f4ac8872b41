"""The parts of `foc_ros play` that need neither a browser nor ROS: messages, clock, scene, tasks, views, and the session."""

from __future__ import annotations

import asyncio
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')
pytest.importorskip('plotly', reason='plotly is not installed')

from report_samples import predictions, samples

from foc_ros.analysis.recordings import find_recordings
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.io.bags import TYPESTORE, BagReader
from foc_ros.io.topics import TYPES
from foc_ros.play import recorder
from foc_ros.play.page_clock import PageClock
from foc_ros.play.page_messages import HandMessage, SceneMessage, TasksMessage, parse_message
from foc_ros.play.prediction_view import Slots
from foc_ros.play.predictors import LibraryPredictor, LivePredictor, State, describe_health
from foc_ros.play.scene import BOUNDS, FIRST_SCENE, START, TARGET_RADIUS, PlayScene, make_box, make_circle, make_random_scene
from foc_ros.play.session import Session
from foc_ros.play.tasks import Phase, Tasks, make_trials, tabulate_scores
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud
from foc_ros.ros.messages.decode_poses import decode_goals
from foc_ros.ros.messages.encode_prediction import encode_prediction_cloud
from foc_ros.ros.messages.types import RosbagsTypes

HAND = {'type': 'hand', 't': 10.0, 'x': 0.1, 'y': 0.0, 'event': 8.0}
CIRCLE = {'kind': 'circle', 'x': 0.1, 'y': 0.0, 'radius': 0.02}
BOX = {'kind': 'box', 'x': 0.2, 'y': 0.05, 'size_x': 0.04, 'size_y': 0.02, 'yaw': 0.5}
SCENE = {'type': 'scene', 'obstacles': [CIRCLE, BOX], 'goals': [{'x': 0.3, 'y': 0.0}]}
TASKS = {'type': 'tasks', 'trials': 2, 'seed': 3, 'assistance': 'mixed', 'blinded': False, 'shuffled': False}


def parse(message: object) -> Any:
    return parse_message(json.dumps(message))


@pytest.mark.parametrize(
    ('message', 'error'),
    [
        ('{', r'message: expected JSON, got .*\{'),
        ('[' * 20_000, 'message: expected JSON'),
        ('[]', r'message: expected an object, got \[\]'),
        ({'type': 'open', 'file': '/etc/passwd'}, "type: expected one of hand, scene, .* got 'open'"),
        ({'type': ['hand']}, 'type: expected one of'),
        (HAND | {'x': 9.0}, r'hand\.x: expected a number in \[-0\.06, 0\.38\], got 9\.0'),
        (HAND | {'x': math.nan}, r'hand\.x: expected a number in .* got nan'),
        (HAND | {'y': '0'}, r"hand\.y: expected a number in .* got '0'"),
        (HAND | {'t': -1}, r'hand\.t: expected a number in \[0, 1e\+10\], got -1'),
        (HAND | {'event': True}, r'hand\.event: expected a number'),
        (HAND | {'topic': '/x'}, "hand: expected the fields t, x, y, event, got 'topic'"),
        ({'type': 'hand', 't': 1.0}, r'hand\.x: expected a value, got none'),
        (SCENE | {'goals': []}, 'goals: expected a list of 1 to 8, got 0'),
        (SCENE | {'goals': {}}, r'goals: expected a list of 1 to 8, got \{\}'),
        (SCENE | {'obstacles': [CIRCLE] * 33}, 'obstacles: expected a list of 0 to 32, got 33'),
        (
            SCENE | {'obstacles': [CIRCLE, BOX | {'size_y': 5}]},
            r'obstacles\[1\]\.size_y: expected a number in .* 0\.3\], got 5',
        ),
        (SCENE | {'obstacles': [CIRCLE | {'kind': 'hull'}]}, "kind: expected one of circle, box, got 'hull'"),
        (SCENE | {'obstacles': [7]}, r'obstacles\[0\]: expected an object, got 7'),
        ({'type': 'shuffle', 'seed': 1.5}, r'seed: expected a whole number in \[0, 2147483647\], got 1\.5'),
        (TASKS | {'trials': 0}, r'trials: expected a whole number in \[1, 200\], got 0'),
        (TASKS | {'assistance': 'some'}, "assistance: expected one of mixed, with, without, got 'some'"),
        ({'type': 'guidance', 'on': 1}, 'on: expected true or false, got 1'),
        ({'type': 'job', 'name': '../../x'}, 'name: expected one of report, fit, compare'),
        ({'type': 'parameters', 'name': '/etc/x.yaml'}, 'name: expected one of standard, mine'),
        ({'type': 'stop', 'on': True}, "message: expected the fields none, got 'on'"),
    ],
)
def test_a_bad_message_is_refused_with_field_value_and_bound(message: Any, error: str) -> None:
    with pytest.raises(InputError, match=error):
        parse_message(message if isinstance(message, str) else json.dumps(message))


def test_a_scene_reaches_the_node_as_it_was_arranged() -> None:
    scene = parse(SCENE).scene
    assert parse({'type': 'scene', **scene.as_json()}) == SceneMessage(scene)
    messages = scene.encode(RosbagsTypes(TYPESTORE), 5)
    decoded, given = decode_point_cloud(messages['obstacles'], 'xy'), scene.tabulate()
    assert (decoded.obstacles.ids, decoded.stamp_ns, decoded.frame_id) == (given.ids, 5, 'play')
    for name in ('centre', 'radius', 'radius_stddev', 'corners', 'vertices'):
        np.testing.assert_allclose(getattr(decoded.obstacles, name), getattr(given, name), atol=1e-8)
    np.testing.assert_allclose(decode_goals(messages['goals'], 'xy')[0], [[0.3, 0.0]])


def test_clearance_is_negative_inside_an_obstacle() -> None:
    scene = PlayScene((make_circle((0.1, 0.0), 0.02), make_box((0.2, 0.0), (0.04, 0.02), 0.0)), ((0.3, 0.0),))
    for position, clearance in (((0.1, 0.03), 0.01), ((0.1, 0.015), -0.005), ((0.2, 0.012), 0.002), ((0.2, 0.004), -0.006)):
        assert scene.measure_clearance(position) == pytest.approx(clearance)
    assert PlayScene((), ((0.3, 0.0),)).measure_clearance((0.0, 0.0)) == math.inf


def test_random_scenes_leave_room_and_repeat_by_seed() -> None:
    for seed in range(50):
        scene = make_random_scene(np.random.default_rng(seed), FIRST_SCENE.goals)
        assert scene == make_random_scene(np.random.default_rng(seed), FIRST_SCENE.goals)
        assert 3 <= len(scene.obstacles) <= 5
        assert parse({'type': 'scene', **scene.as_json()}).scene == scene  # within the bounds of the page
        for point in (START, *scene.goals):
            assert scene.measure_clearance(point) > TARGET_RADIUS
    assert scene != make_random_scene(np.random.default_rng(0), FIRST_SCENE.goals)


def test_stamps_follow_the_quickest_message_and_never_step_back() -> None:
    clock, second = PageClock(), 10**9
    assert clock.stamp(1000.0, 100 * second) == 100 * second
    # this message took 50 ms less: those after it count from there
    assert clock.stamp(1060.0, 100 * second + 10_000_000) == 100 * second + 10_000_000
    assert clock.stamp(1080.0, 100 * second + 90_000_000) == 100 * second + 30_000_000
    # 20 ms later it took 40 ms less again: its stamp would step back
    assert clock.stamp(1090.0, 100 * second) is None
    assert clock.stamp(1130.0, 100 * second + 45_000_000) == 100 * second + 40_000_000
    with pytest.raises(InputError, match=r'hand\.t: expected a time after the last one, 1130\.0 ms, got 1130\.0'):
        clock.stamp(1130.0, 101 * second)
    with pytest.raises(InputError, match=r'hand\.t: expected a time before .* ms, got 9000000000'):
        clock.stamp(9e9, 101 * second)
    assert clock.stamp(1140.0, 100 * second + 60_000_000) == 100 * second + 50_000_000


def test_a_sequence_is_balanced_and_repeats_by_seed() -> None:
    settings = TasksMessage(12, 3, 'mixed', False, True)
    trials = make_trials(settings, FIRST_SCENE)
    assert trials == make_trials(settings, FIRST_SCENE) != make_trials(replace(settings, seed=4), FIRST_SCENE)
    kinds = [(each.goal, each.is_guided) for each in trials]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {(goal, on): 2 for goal in range(3) for on in (False, True)}
    assert len({each.scene for each in trials}) == 12
    assert not any(each.is_guided for each in make_trials(replace(settings, assistance='without'), FIRST_SCENE))


def test_a_trial_is_scored() -> None:
    """The hand moves along x at 0.1 m/s through a circle, and the way of number 7 is the most likely one from x = 0.1 m on."""
    scene = PlayScene((make_circle((0.15, 0.0), 0.02),), ((0.3, 0.0),))
    tasks = Tasks(TasksMessage(1, 0, 'without', False, False), scene)
    assert [tasks.follow(0.0, (0.2, 0.0)), tasks.follow(0.1, START)] == [None, Phase.WAIT]
    assert tasks.follow(0.2, (0.1, 0.0)) is Phase.RETURN
    begin = next(t for t in (0.3 + 0.01 * step for step in range(200)) if tasks.follow(t, START) is Phase.REACH)
    assert 0.4 <= begin - 0.3 <= 0.91
    t = 0.0
    while tasks.phase is Phase.REACH:
        t += 0.01
        position = (min(0.1 * t, 0.3), 0.0)
        tasks.follow(begin + t, position)
        tasks.note_most_likely(begin + t, 7 if position[0] >= 0.1 else 3)
        assert t < 10.0
    assert tasks.phase is Phase.OVER
    assert tasks.follow(begin + 9.0, START) is None
    (score,) = tasks.scores
    assert score.touched == 1
    assert score.time_s == pytest.approx(2.85, abs=0.02)  # at the edge of the goal
    assert score.path_m == pytest.approx(0.3, abs=0.02)
    assert score.ahead_s == pytest.approx(1.85, abs=0.03)
    numbers = f'{score.time_s:.2f}', '1', f'{100.0 * score.path_m:.1f}', f'{score.ahead_s:.2f}'
    assert tabulate_scores([score]) == [('without guidance', '1', *numbers)]


@pytest.mark.parametrize(
    ('message', 'words'),
    [
        ('predicting', 'predicting'),
        ('no prediction: no hand pose yet', 'no prediction: no hand pose yet'),
        ('hand_superseded 3', 'predicting; 3 positions were passed over, because this computer is busy'),
        ('busy: a; hand_late 2; predict_nothing_solved 1', 'busy: a; hand_late 2; 1 predictions found no way'),
    ],
)
def test_counters_of_the_node_are_shown_in_words(message: str, words: str) -> None:
    assert describe_health(message) == words


def test_a_class_keeps_its_slot_while_it_is_followed() -> None:
    slots = Slots()
    assert slots.assign([5, 9]) == [0, 1]
    assert slots.assign([9, 4, 5]) == [1, 2, 0]
    assert slots.assign([4]) == [2]
    assert slots.assign([4, 5]) == [2, 3]  # slot 0 is free for a short time only: the others come first
    assert slots.assign(list(range(20)))[12:] == [None] * 8


class Silent(LivePredictor):
    """A predictor that keeps what it is given."""

    name = 'silent'

    def start(self) -> None:
        self.sent: list[tuple[str, bytes]] = []
        self.configs: list[Config] = []

    def stop(self) -> None:
        pass

    def send(self, role: str, raw: bytes) -> None:
        self.sent.append((role, raw))

    def configure(self, config: Config) -> None:
        self.configs.append(config)

    def check(self) -> State:
        return State(True, 'silent')


class Page:
    """A page that keeps what it receives."""

    def __init__(self, session: Session) -> None:
        self.session, self.received = session, []
        self.t_ms = 0.0
        session.open(self.receive)

    def receive(self, message: dict[str, Any]) -> None:
        self.received.append(json.loads(json.dumps(message, allow_nan=False)))

    def send(self, message: dict[str, Any]) -> None:
        self.session.take(parse(message), self.receive)

    def last(self, kind: str) -> dict[str, Any]:
        return next(each for each in reversed(self.received) if each['type'] == kind)

    def move(self, position: tuple[float, float], count: int = 1) -> None:
        for _ in range(count):
            self.t_ms += 20.0
            if self.t_ms % 500.0 == 0.0:
                self.session.tick()
            self.send({'type': 'hand', 't': self.t_ms, 'x': position[0], 'y': position[1], 'event': self.t_ms})


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Page:
    """Return a page of a session whose clock goes on with the time of the page."""
    session = Session(Silent, Config(), tmp_path / 'data')
    session.predictor.start()
    page = Page(session)
    monkeypatch.setattr('foc_ros.play.session.time_ns', lambda: 10**15 + round(page.t_ms * 1e6))
    return page


def reach(page: Page) -> None:
    """Do one trial, straight to the goal at 0.25 m/s."""
    page.move(START, 60)
    assert page.last('task')['phase'] == 'reach'
    goal = FIRST_SCENE.goals[page.last('task')['goal']]
    for share in np.linspace(0.0, 1.0, 60):
        page.move((share * goal[0], share * goal[1]))
    page.move(goal, 20)


def test_tasks_leave_bags_that_fit_and_evaluate_read(page: Page) -> None:
    page.send(TASKS)
    with pytest.raises(InputError, match='scene: expected no change while tasks run'):
        page.send(SCENE)
    for _ in range(2):
        reach(page)
    assert page.last('task') == {'type': 'task', 'phase': 'none'}
    assert sorted(row[0] for row in page.last('score')['rows']) == ['with guidance', 'without guidance']
    assert [each.guidance.enabled for each in page.session.predictor.configs] in ([True, False], [True])
    folder = Path(page.last('settings')['session'])
    (name,) = recordings = find_recordings(folder / recorder.UNGUIDED)
    replay = Replay(Config(rate_hz=5.0))
    steps = list(replay.steps(recordings[name].items()))
    stamps = [step.sample.stamp_ns for step in steps if step.sample is not None]
    assert {round(gap) for gap in np.diff(stamps)} == {20_000_000}
    assert any(step.prediction is not None and step.prediction.candidates_with_likelihood for step in steps)
    assert replay.describe_refusals() == ''
    with BagReader(folder / recorder.SESSION) as reader:
        assert sum(item.role == 'hand_pose' for item in reader) > len(stamps)


def test_a_stopped_task_leaves_its_session_and_restores_guidance(page: Page) -> None:
    page.send(TASKS | {'assistance': 'with'})
    page.move(START, 60)
    page.send({'type': 'stop'})
    assert page.last('score')['rows'] == []
    assert [each.guidance.enabled for each in page.session.predictor.configs] == [True, False]
    folder = Path(page.last('settings')['session'])
    assert sorted(each.name for each in folder.iterdir()) == ['parameters.yaml', 'session']


def test_a_blinded_page_learns_nothing_from_what_it_receives(page: Page) -> None:
    """The page receives no prediction, and the same messages with and without guidance; the force itself must be felt."""
    received = {}
    for assistance in ('with', 'without'):
        page.send(TASKS | {'assistance': assistance, 'blinded': True})
        begin = len(page.received)
        page.move(START, 100)
        prediction = encode_prediction_cloud(predictions(samples())[0], 'xy', RosbagsTypes(TYPESTORE))
        page.session._receive('/foc/prediction', bytes(TYPESTORE.serialize_cdr(prediction, prediction.__msgtype__)))
        received[assistance] = page.received[begin:]
        page.send({'type': 'stop'})
    assert received['with'] == received['without']
    assert {each['type'] for each in received['with']} == {'task', 'status'}


@pytest.mark.timeout(500)
def test_a_fit_and_its_comparison(page: Page) -> None:
    """The commands behind the buttons, on three trials."""

    async def work(name: str) -> dict[str, Any]:
        page.send({'type': 'job', 'name': name})
        await wait_until(lambda: page.last('job')['state'] != 'running', 400.0)
        assert page.last('job')['state'] == 'done', page.last('job')
        return page.last('job')

    async def run() -> None:
        fitted = await work('fit')
        assert fitted['columns'] == ['parameter', 'before', 'after']
        assert 'duration.fitts_b_s' in [row[0] for row in fitted['rows']]
        compared = await work('compare')
        assert 'on the trials of the fit' in compared['text']
        assert [row[0] for row in compared['rows']][:2] == ['path class: correct [%]', 'path class: log-likelihood [nat]']

    page.send(TASKS | {'trials': 3, 'assistance': 'without'})
    for _ in range(3):
        reach(page)
    asyncio.run(run())
    assert page.last('settings')['fitted']
    page.send({'type': 'parameters', 'name': 'mine'})  # the page keeps the others if positions become worse
    assert page.last('settings')['parameters'] == 'mine'
    mine = page.session.predictor.configs[-1]
    assert mine.duration != Config().duration
    assert mine.plane == 'xy'
    page.send({'type': 'parameters', 'name': 'standard'})
    assert page.session.predictor.configs[-1] == Config()


def test_what_is_impossible_is_refused(page: Page) -> None:
    for message, error in (
        ({'type': 'job', 'name': 'report'}, 'job: expected a session that was recorded, got report'),
        ({'type': 'parameters', 'name': 'mine'}, 'parameters: expected standard until parameters were fitted, got mine'),
    ):
        with pytest.raises(InputError, match=error):
            page.send(message)
    page.send({'type': 'record', 'on': True})
    page.move(START, 3)
    page.send({'type': 'record', 'on': False})
    with pytest.raises(InputError, match='job: expected a session with trials without guidance, got fit'):
        page.send({'type': 'job', 'name': 'fit'})
    assert page.last('settings')['recording'] is False


def test_only_the_newest_page_steers(page: Page) -> None:
    other = Page(page.session)
    assert page.last('replaced') == {'type': 'replaced'}
    before = len(page.session.predictor.sent)
    page.move(START)
    assert len(page.session.predictor.sent) == before
    other.move(START)
    assert [role for role, _ in page.session.predictor.sent[before:]] == ['hand_pose']


def test_a_full_disk_ends_the_recording_and_nothing_else(page: Page, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, 'No space left on device')

    page.send({'type': 'record', 'on': True})
    monkeypatch.setattr('rosbags.rosbag2.Writer.write', fail)
    page.move(START)
    assert 'No space left' in page.last('error')['text']
    assert page.last('settings')['recording'] is False
    page.move(START)


def test_the_library_predicts_and_reports_the_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The hand moves to a goal; the report holds what was predicted, and the bag what was sent."""

    async def run() -> tuple[Page, Session]:
        loop = asyncio.get_running_loop()

        def make(config: Config, receive: Any) -> LivePredictor:
            return LibraryPredictor(config, lambda topic, raw: loop.call_soon_threadsafe(receive, topic, raw))

        session = Session(make, Config(budget_s=0.0, rate_hz=20.0), tmp_path)
        session.predictor.start()
        try:
            page = Page(session)
            monkeypatch.setattr('foc_ros.play.session.time_ns', lambda: 10**15 + round(page.t_ms * 1e6))
            session.tick()
            page.send({'type': 'record', 'on': True})
            for step in range(60):
                page.move((0.004 * step, 0.0006 * step))
                if step % 10 == 9:
                    count = len(page.received)
                    await wait_until(lambda count=count, page=page: any(m['type'] == 'prediction' for m in page.received[count:]))
            page.send({'type': 'record', 'on': False})
            page.send({'type': 'job', 'name': 'report'})
            await wait_until(lambda: page.last('job')['state'] != 'running')
        finally:
            session.close()
        return page, session

    page, session = asyncio.run(run())
    assert page.last('job')['state'] == 'done', page.last('job')
    assert session.report is not None
    numbers = json.loads((session.report.parent / 'predictions.json').read_text(encoding='utf-8'))
    assert numbers['hand_samples'] == 60
    assert numbers['predictions'], 'how many depends on how busy the machine is'
    shown = page.last('prediction')
    assert sum(each['likelihood'] for each in shown['candidates']) == pytest.approx(1.0, abs=1e-3)
    low_x, high_x, low_y, high_y = BOUNDS
    for each in shown['candidates']:
        path = np.array(each['path'])
        assert ((path >= [low_x, low_y]) & (path <= [high_x, high_y])).all()
        np.testing.assert_allclose(path[-1], FIRST_SCENE.goals[each['goal']], atol=2e-3)
    with BagReader(Path(page.last('settings')['session']) / recorder.SESSION) as reader:
        topics = {each.topic for each in reader._connections}
        assert {TYPES[item.role] for item in reader} == {TYPES[role] for role in ('hand_pose', 'obstacles', 'goals')}
    assert topics == {'/hand_pose', '/obstacles', '/goals', '/foc/prediction', '/foc/likelihoods'}


async def wait_until(condition: Any, seconds: float = 30.0) -> None:
    deadline = asyncio.get_running_loop().time() + seconds
    while not condition():
        assert asyncio.get_running_loop().time() < deadline
        await asyncio.sleep(0.01)


def test_a_hand_message_is_read() -> None:
    assert parse(HAND) == HandMessage(10.0, (0.1, 0.0), 8.0)
