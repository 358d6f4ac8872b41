# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of `foc_ros play` in a browser: steered by synthetic events, loaded again, on a phone; and broken pages."""

import math
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('tornado', reason='tornado is not installed')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from browser_helpers import check_report, screenshot
from play_helpers import await_layout, find_point, play, press_keys, steer, tab_to, until, visit, wait_for, wait_for_answer

from foc_ros.core.config import Config
from foc_ros.ros.parameters import dump_parameter_file

ABOVE = (0.07, 0.035), (0.13, 0.056)
"""On a path above the first circle [m]."""
ON = (0.2, 0.045), (0.3, 0.09)
"""On to goal 2 [m]."""


@pytest.fixture(scope='module')
def parameters(tmp_path_factory):
    """Return a file with parameters without a time limit, which a busy machine would exceed."""
    file = tmp_path_factory.mktemp('parameters') / 'foc.yaml'
    file.write_text(dump_parameter_file(Config(budget_s=0.0, rate_hz=20.0)), encoding='utf-8')
    return str(file)


@pytest.fixture(scope='module')
def library(tmp_path_factory, parameters):
    with play(tmp_path_factory.mktemp('library'), '--params', parameters) as started:
        yield started


@pytest.fixture
def page(browser, library):
    """Open the page anew, with the hand at the start; leave it after the test, because it keeps a processor busy."""
    visit(browser, library)
    steer(browser, (0.0, 0.0), speed=1.0)  # the hand of the page before is where it was
    click(browser, 'restore')
    yield browser
    browser.get('about:blank')


def click(browser, name):
    browser.execute_script(f"document.getElementById('{name}').click()")


def text_of(browser, name):
    return str(browser.execute_script(f"return document.getElementById('{name}').innerText"))


def has_numbers(browser):
    steer(browser, (0.29, 0.085), ON[-1])
    measured = 'play.measured.mostMs >= play.measured.delayMs && play.measured.delayMs > 0 && play.measured.delays.length > 5'
    return bool(browser.execute_script(f'return {measured}'))


def shares(browser):
    """Return the likelihoods of all candidates above and below the first circle, when those of the present position have come.

    What is missing from 1 is the share of the classes that are not followed, which say nothing about a side.
    """
    wait_for_answer(browser)
    found = [0.0, 0.0]
    for each in browser.execute_script('return play.view.candidates'):
        path = np.array(each['path'])
        found[bool(np.interp(0.14, path[:, 0], path[:, 1]) < 0.015)] += each['likelihood'] or 0.0
    return found[0], found[1]


def share_above(browser):
    return shares(browser)[0]


def test_the_likelihood_of_the_path_taken_rises_and_frames_and_delay_are_measured(page):
    wait_for(page, 'globalThis.play && play.view.candidates.length > 0', 'predictions', 20)
    assert [each for each in page.get_log('browser') if each['level'] == 'SEVERE'] == []
    steer(page, (0.0, 0.0))
    wait_for(page, 'play.view.candidates.length > 1', 'candidates at the start', 20)
    until(lambda: 0.0 < share_above(page) < 0.4, 'a likelihood of the way above at the start', 20)
    steer(page, ABOVE[0], speed=0.2)
    until(lambda: 0.4 < share_above(page) < 1.0, 'a larger likelihood of the way above', 20)
    steer(page, ABOVE[1], speed=0.2)
    until(lambda: share_above(page) > 0.85 and shares(page)[1] < 0.03, 'no doubt of the way taken', 20)
    steer(page, *ON)
    wait_for(page, 'Math.abs(play.view.hand.position[0] - 0.3) < 0.003', 'the hand at the goal', 20)
    until(lambda: has_numbers(page), 'numbers', 20)
    text = "return document.getElementById('numbers').textContent"
    until(lambda: READ.search(page.execute_script(text)), 'the latency in words', 20)


def test_the_status_line_is_not_green_while_predictions_come_late(page):
    """Whatever the machine does, the time from an input to its prediction decides, and it is told."""
    steer(page, (0.05, 0.02), (0.0, 0.0), speed=0.1)
    page.execute_script('play.measured.delays.fill(400)')
    wait_for(page, "document.getElementById('status').innerText.startsWith('predictions come')", 'what is late', 20)
    assert page.execute_script("return document.getElementById('status').className") == 'status waiting'
    steer(page, (0.14, 0.015))
    page.execute_script('play.measured.delays.fill(400)')
    words = "/^predicting, but .*; predictions come/.test(document.getElementById('status').innerText)"
    wait_for(page, words, 'what else there is to tell', 20)


def test_a_prediction_is_drawn_when_it_comes_and_not_in_the_next_frame(page):
    """What is drawn in a frame is seen with the one after."""
    page.execute_script('[play.request, play.held] = [requestAnimationFrame, []]')
    page.execute_script('globalThis.requestAnimationFrame = (frame) => play.held.push(frame)')
    wait_for(page, 'play.held.length > 0', 'the last frame', 20)
    page.execute_script('play.measured.delays.length = 0')
    steer(page, (0.05, 0.02), (0.0, 0.0), speed=0.1)
    wait_for(page, 'play.measured.delays.length > 3', 'predictions that are drawn', 20)
    page.execute_script('globalThis.requestAnimationFrame = play.request; requestAnimationFrame(play.held[0])')


def test_a_gamepad_steers_and_guidance_pulls(page):
    page.execute_script('navigator.getGamepads = () => [null, { axes: [1, 0.1] }]')
    wait_for(page, 'play.view.hand.position[0] > 0.1', 'the hand follows a stick', 20)
    page.execute_script('navigator.getGamepads = undefined')  # as on a phone, which reaches the page without encryption
    click(page, 'guidance')
    page.execute_script("""
        globalThis.mostPull = 0;
        setInterval(() => { mostPull = Math.max(mostPull, Math.hypot(...play.view.hand.pull)); }, 5);
    """)

    def is_pulled():
        steer(page, (0.06, 0.0), (0.12, -0.008), speed=0.15)
        return page.execute_script('return mostPull > 1e-4')

    until(is_pulled, 'a pull of guidance')
    click(page, 'guidance')


READ = re.compile(r'^\d+ frames a second, \d+ ms from your hand to the drawn prediction \(median; nine in ten within \d+ ms\)$')
RIGHT, LEFT, UP, DOWN, DELETE, ENTER, SPACE = '\ue014', '\ue012', '\ue013', '\ue015', '\ue017', '\ue007', ' '


def move_by_keys(browser, goal, near=0.008):
    """Hold arrow keys, one after the other, until the hand is near a goal [m]."""

    def is_there():
        position = browser.execute_script('return play.view.hand.position')
        left = [wanted - is_at for wanted, is_at in zip(goal, position, strict=True)]
        axis = int(abs(left[1]) > abs(left[0]))
        if math.hypot(*left) > near:
            # STICK_SPEED of hand.js is 0.35 m/s; a little less, because the hand goes on for a moment
            key = ((LEFT, RIGHT), (DOWN, UP))[axis][left[axis] > 0.0]
            press_keys(browser, key, hold_s=max(0.02, 0.8 * abs(left[axis]) / 0.35))
        return math.hypot(*left) <= near

    until(is_there, f'the hand at {goal}')


BARS = """
const colourAt = (row) => getComputedStyle(row.querySelector('.bar i')).backgroundColor;
const probe = document.body.appendChild(document.createElement('i'));
const rows = [...document.querySelectorAll('#ways tr')].map(
  (row) => [row.querySelector('.letter').innerText, colourAt(row), row.cells[3].innerText]).filter(([letter]) => letter);
const lettered = play.view.candidates.filter(({ likelihood, slot }) => likelihood >= 0.01 && slot !== null);
const drawn = lettered.map(({ slot, ghost }) => {
  probe.style.color = ghost ? ink('--soft') : colourOf(slot);
  return [letterOf(slot), getComputedStyle(probe).color];
});
return [rows, drawn];
"""
"""Letters, colours and words of the bars, and letters and colours of the paths."""


def test_bars_have_the_colours_of_their_paths_and_paths_to_one_goal_differ_in_words(page):
    def are_same():
        rows, drawn = page.execute_script(BARS)
        return len(rows) > 2 and sorted(row[:2] for row in rows) == sorted(drawn) and rows

    rows = until(are_same, 'bars like the paths', 20)
    words = [row[2] for row in rows]
    assert len(set(words)) == len(words) and all(text.startswith('goal') for text in words)
    names = [text.partition(';')[0] for text in words]
    assert names == sorted(names)  # by goals and names, so that a bar stays where it is


def test_a_bar_is_pale_or_dotted_where_its_path_is(page):
    shown = """return [{ ghost: 'why' }, { compromised: true }, { ghost: 'why', compromised: true }, {}].map((each) => {
        const [letter, bar] = makeSigns({ slot: 1, likelihood: 0.5, ...each });
        const look = bar.firstChild;
        return [letter.style.borderColor === look.style.backgroundColor, look.style.opacity < 0.5, look.className === 'dotted'];
    })"""
    pale, dotted = [True, True, False], [True, False, True]
    assert page.execute_script(shown) == [pale, dotted, pale, [True, False, False]]


def test_letters_of_equal_paths_stand_apart_and_only_those_that_have_room(page):
    places = """const path = Array.from({ length: 41 }, (_, row) => [arguments[0] * row, 0]);
        const candidate = { likelihood: 0.08, path, motor: [], total: [], ghost: '' };
        const ghost = arguments[1] ? [{ ...candidate, ghost: 'eta unreachable' }] : [];
        play.scene.begin();
        play.scene.candidates([...Array.from({ length: 12 }, (_, slot) => ({ slot, ...candidate })), ...ghost]);
        return [play.scene.letters, play.scene.unit];"""
    for step, is_ghost, least in ((0.007, False, 6), (0.007, True, 3), (0.0005, False, 1)):
        letters, unit = page.execute_script(places, step, is_ghost)
        assert least <= len(letters) < 12
        assert not is_ghost or min(abs(x - 20 * step) for x, _ in letters) > 45.0 * unit, 'the words have their room'
        assert (np.diff(np.sort(np.array(letters)[:, 0])) > 18.0 * unit).all()  # wider than a letter


FORCES = """
const [force, done] = [document.querySelector('#signs span:nth-child(3) path'), arguments[0]];
const probe = document.body.appendChild(document.createElement('i'));
play.scene.line = (points, colour, width) => {
  if (width <= 1) return;
  probe.style.color = colour;
  delete play.scene.line;
  done([[getComputedStyle(force).stroke, getComputedStyle(force).strokeWidth], [getComputedStyle(probe).color, `${width}px`]]);
};
play.view.hand.setForce([1, 0], 1e9);
"""
"""Colour and width of the force of guidance, in the help and as it is drawn."""


def test_help_shows_the_force_of_guidance_as_it_is_drawn(page):
    click(page, 'theme')
    in_help, drawn = page.execute_async_script(FORCES)
    assert in_help == drawn


def test_everything_can_be_done_by_keys_and_survives_a_reload(page, tmp_path):
    """Move the hand, arrange the scene, switch guidance, record, do a task, write a report and download it, without a pointer."""
    page.execute_cdp_cmd('Browser.setDownloadBehavior', {'behavior': 'allow', 'downloadPath': str(tmp_path)})
    tab_to(page, 'scene')
    move_by_keys(page, (0.05, -0.03))
    press_keys(page, 'e')
    wait_for(page, "!document.getElementById('editing').hidden", 'the buttons for arranging')
    press_keys(page, 'c')
    wait_for(page, 'play.view.scene.obstacles.length === 4 && play.view.selected === play.view.scene.obstacles[3]', 'a circle')
    added = page.execute_script('return structuredClone(play.view.scene.obstacles[3])')
    others = page.execute_script('return [...play.view.scene.obstacles.slice(0, 3), ...play.view.scene.goals]')
    assert min(math.hypot(added['x'] - each['x'], added['y'] - each['y']) for each in others) >= 0.05
    press_keys(page, *(3 * [DOWN]))
    wait_for(page, f'Math.abs(play.view.scene.obstacles[3].y - {added["y"] - 0.015}) < 1e-6', 'the circle below')
    press_keys(page, DELETE, 'g', RIGHT)
    wait_for(
        page, 'play.view.scene.obstacles.length === 3 && play.view.scene.goals.length === 4', 'a goal in place of the circle'
    )
    wait_for(page, 'play.view.candidates.some((each) => each.goal === 3)', 'a path to the new goal')
    press_keys(page, DELETE, 'n')
    wait_for(page, 'play.view.selected === play.view.scene.obstacles[0] && play.view.scene.goals.length === 3', 'an obstacle')
    assert page.execute_script('return play.view.hand.position') == pytest.approx([0.05, -0.03], abs=0.02), 'the hand stays'
    press_keys(page, 'e')
    for is_on in (True, False):
        tab_to(page, 'guidance')
        press_keys(page, SPACE)
        assert page.execute_script("return document.getElementById('guidance').checked") is is_on
    tab_to(page, 'trials')
    press_keys(page, UP, DOWN, *(11 * [DOWN]))
    tab_to(page, 'begin')
    press_keys(page, ENTER)
    wait_for(page, "document.getElementById('task').innerText.startsWith('1 of 1: ')", 'the task')
    assert page.execute_script('return document.activeElement.id') == 'scene'
    assert text_of(page, 'record') == 'record', 'the button does not offer to end what the tasks record'
    move_by_keys(page, (0.0, 0.0))
    wait_for(page, "play.view.phase === 'reach'", 'the light')
    goal = page.execute_script('return [play.view.scene.goals[play.view.goal].x, play.view.scene.goals[play.view.goal].y]')
    move_by_keys(page, tuple(goal))
    wait_for(page, "document.querySelectorAll('#score tr').length === 2", 'the score')
    tab_to(page, 'record')
    press_keys(page, ENTER)
    wait_for(page, "document.getElementById('session').innerText.startsWith('Recording to ')", 'a recording')
    assert text_of(page, 'score') == '', 'it is of the session before'
    tab_to(page, 'scene')
    move_by_keys(page, (0.1, 0.0))
    wait_for_answer(page)
    tab_to(page, 'record')
    press_keys(page, ENTER)
    wait_for(page, "document.getElementById('session').innerText.startsWith('Recorded to ')", 'the end of the recording')
    tab_to(page, 'report')
    press_keys(page, ENTER)
    wait_for(page, "!document.getElementById('download').hidden", 'the report')
    tab_to(page, 'download-link')
    press_keys(page, ENTER)
    file = tmp_path / 'foc_ros_report.html'
    until(file.exists, 'the downloaded report')
    unfit = page.execute_script("return ['fit', 'compare'].map((name) => [byId(name).disabled, byId(name).title])")
    assert unfit == 2 * [[True, 'needs tasks with trials without guidance']]
    folder = Path(text_of(page, 'session').removeprefix('Recorded to '))
    until(lambda: file.read_bytes() == (folder / 'report' / 'index.html').read_bytes(), 'all of the report')
    kept = [text_of(page, name) for name in ('score', 'session', 'job', 'result')]
    before = page.execute_script('return play.view.hand.position')
    page.refresh()
    wait_for(page, 'globalThis.play && play.view.candidates.length > 0', 'predictions')
    assert page.execute_script('return play.view.hand.position') == pytest.approx(before, abs=0.01), 'the hand is where it was'
    assert [text_of(page, name) for name in ('score', 'session', 'job', 'result')] == kept
    assert page.execute_script("return document.getElementById('trials').value") == '1'
    assert not page.execute_script("return document.getElementById('download').hidden")
    page.get('about:blank')
    check_report(page, folder / 'report')


PHONE = 360, 640


PLACES = """return arguments[0].map((name) => document.getElementById(name).getBoundingClientRect())
    .map(({ top, bottom }) => [top, bottom])"""


def test_an_object_too_many_is_refused_and_new_ones_lie_apart(page):
    click(page, 'arrange')
    page.execute_script("for (let count = 0; count < 6; count += 1) byId('add-goal').click();")
    words = "document.getElementById('status').innerText.startsWith('refused: goals: expected at most 8')"
    wait_for(page, words, 'the reason', 5)
    places = np.array(page.execute_script('return play.view.scene.goals.map(({ x, y }) => [x, y])'))
    assert len(places) == 8
    assert min(math.dist(one, other) for row, one in enumerate(places) for other in places[:row]) > 0.04


STAYS = """
const tops = () => ['scene', 'score'].map((name) => byId(name).getBoundingClientRect().top);
const before = tops();
byId('status').textContent = 'words '.repeat(60);
const rows = byId('ways').tBodies[0];
rows.replaceChildren();
const empty = tops();
for (let row = 0; row < 40; row += 1) rows.insertRow().insertCell().textContent = 'words';
return [before, empty, tops()];
"""
"""Where the scene is, and what is below the bars, before and after changes of the status and of the bars."""


@pytest.mark.parametrize('size', [(1280, 720), (1366, 650)])
def test_the_scene_and_its_buttons_are_on_one_screen(browser, library, size):
    visit(browser, library, *size)
    click(browser, 'arrange')
    for top, bottom in browser.execute_script(PLACES, ['scene', 'buttons', 'editing']):
        assert 0.0 <= top < bottom <= size[1]
    before, *others = browser.execute_script(STAYS)
    assert others == [before, before]
    browser.get('about:blank')


@pytest.mark.parametrize('dark', [False, True], ids=['light', 'dark'])
def test_the_page_fits_on_a_phone(browser, library, dark):
    visit(browser, library, *PHONE, dark)
    for top, bottom in browser.execute_script(PLACES, ['scene', 'buttons']):
        assert 0.0 <= top < bottom <= PHONE[1], 'scene and buttons are on one screen'
    assert browser.execute_script("return document.querySelector('details').open") is False, 'help is folded'
    before, *others = browser.execute_script(STAYS)
    assert others == [before, before]
    colour = 'return getComputedStyle(document.body).backgroundColor'
    before = browser.execute_script(colour)
    assert before == ('rgb(20, 24, 28)' if dark else 'rgb(255, 255, 255)')
    assert len(screenshot(browser)) > 20_000
    click(browser, 'theme')
    assert browser.execute_script(colour) != before
    click(browser, 'arrange')
    assert text_of(browser, 'remove') == 'remove', 'no keys on a phone'
    browser.execute_script("""
        document.getElementById('download').hidden = false;
        document.getElementById('session').textContent = `Recorded to /a/${'long'.repeat(30)}/folder`;
        for (const name of ['score', 'result']) {
          const line = document.createElement('table').insertRow();
          for (let column = 0; column < 6; column += 1) line.insertCell().textContent = 'estimator.acceleration_time_s';
          document.getElementById(name).append(line.closest('table'));
        }
    """)
    assert browser.execute_script('return document.documentElement.scrollWidth') == PHONE[0]
    unnamed = """return [...document.querySelectorAll('button, input, select, canvas')].filter(
        (each) => !(each.innerText || each.ariaLabel || (each.labels && each.labels.length)))"""
    assert browser.execute_script(unnamed) == []
    assert browser.execute_script("return performance.getEntriesByType('resource').every((each) => each.name.startsWith(origin))")
    browser.get('about:blank')


def test_a_finger_moves_the_hand_and_what_it_drags_changes_the_prediction_and_is_kept(browser, library):
    visit(browser, library, *PHONE)
    click(browser, 'restore')
    first = 'Math.hypot(play.view.scene.obstacles[0].x - 0.14, play.view.scene.obstacles[0].y - 0.015) < 2e-3'
    wait_for(browser, first, 'the first scene')

    def drag(*points):
        for row, point in enumerate(points):
            x, y = find_point(browser, point)
            kind = 'touchMove' if row else 'touchStart'
            browser.execute_cdp_cmd('Input.dispatchTouchEvent', {'type': kind, 'touchPoints': [{'x': x, 'y': y}]})
        browser.execute_cdp_cmd('Input.dispatchTouchEvent', {'type': 'touchEnd', 'touchPoints': []})

    drag((0.0, 0.0), (0.02, -0.02), (0.1, -0.04))
    wait_for(browser, 'Math.hypot(play.view.hand.position[0] - 0.1, play.view.hand.position[1] + 0.04) < 2e-3', 'the hand')
    click(browser, 'arrange')
    await_layout(browser)
    for name, row, place in (('obstacles', 0, (0.13, 0.13)), ('goals', 1, (0.25, 0.04))):
        for _ in range(5):  # while the page is slow, controls that appear may move the scene away from under the finger
            x, y = browser.execute_script(f'const it = play.view.scene.{name}[{row}]; return [it.x, it.y]')
            if (x, y) == pytest.approx(place, abs=2e-3):
                break
            drag((x, y), ((x + place[0]) / 2, (y + place[1]) / 2), place)
            time.sleep(0.5)
        else:
            raise AssertionError(f'{name}[{row}] is at {x, y}')
    assert browser.execute_script('return [scrollX, scrollY]') == [0, 0]
    click(browser, 'arrange')
    ahead = 'play.view.candidates.some(({ goal, path }) => goal === 1 && Math.abs(path.at(-1)[0] - 0.25) < 5e-3)'
    wait_for(browser, ahead, 'a path to the goal where it is now')
    browser.refresh()
    wait_for(browser, 'play.view.scene.obstacles.some(({ y }) => Math.abs(y - 0.13) < 2e-3)', 'the scene is kept')
    click(browser, 'restore')
    browser.get('about:blank')


CONTROLS = "[...document.querySelectorAll('main :is(button, input, select)')]"


def test_the_page_says_that_the_server_is_gone_and_recovers_as_the_page_of_another_one(browser, tmp_path):
    with play(tmp_path) as started:
        visit(browser, started)
        started.process.send_signal(signal.SIGSTOP)
        silent = "document.getElementById('status').innerText.startsWith('no answer from the server for ')"
        wait_for(browser, silent, 'the server is silent', 5)
        assert browser.execute_script("return document.getElementById('status').className") == 'status failing'
        started.process.send_signal(signal.SIGCONT)
        wait_for(browser, "document.getElementById('status').className !== 'status failing'", 'the server answers again', 20)
        click(browser, 'begin')
        wait_for(browser, "play.view.phase !== 'none'", 'a task', 20)
        click(browser, 'begin')
        wait_for(browser, "document.getElementById('score').innerText === 'No trial was finished.'", 'a score', 20)
        wait_for(browser, "document.getElementById('session').innerText.startsWith('Recorded to ')", 'a recording', 20)
        port = started.url.rpartition(':')[2]
    assert 'Traceback' not in started.output
    wait_for(browser, "document.getElementById('status').innerText === 'The server is gone; trying again.'", 'the message')
    assert browser.execute_script('return play.view.candidates.length') == 0
    assert browser.execute_script(f'return {CONTROLS}.every((each) => each.disabled)')
    with play(tmp_path, '--port', port) as other:
        wait_for(browser, 'play.view.candidates.length > 0', 'predictions after a new start of the server')
        disabled = browser.execute_script(f'return {CONTROLS}.filter((each) => each.disabled).map(({{ id }}) => id)')
        assert disabled == ['report', 'fit', 'compare'], 'there is no session yet'
        wait_for(browser, "document.getElementById('status').className === 'status well'", 'the message is gone')
        assert text_of(browser, 'score') == ''
        assert re.fullmatch(r'Tasks and recordings are kept in \S+, also earlier ones\.', text_of(browser, 'session'))
        first = browser.current_window_handle
        browser.switch_to.new_window('tab')
        browser.get(other.url)
        browser.switch_to.window(first)
        replaced = "document.getElementById('status').innerText.startsWith('Another page has taken over.')"
        wait_for(browser, replaced, 'the new page', 20)
        assert browser.execute_script(f'return {CONTROLS}.every((each) => each.disabled)')
        browser.close()
        browser.switch_to.window(browser.window_handles[0])
        browser.get('about:blank')
