# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`foc_ros play` as a process, its page in a browser, and a hand that is steered by synthetic events."""

import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from browser_helpers import show_address

STARTED = re.compile(r'open (http://\S+) ')
STEER = """
const [targets, speed, done] = arguments;
const canvas = document.getElementById('scene');
const { settings, view } = play;
const box = canvas.getBoundingClientRect();
const [low, high, bottom, top] = settings.bounds;
const point = ([x, y]) => canvas.dispatchEvent(new PointerEvent('pointermove', {
  clientX: box.left + box.width * (x - low) / (high - low), clientY: box.top + box.height * (top - y) / (top - bottom),
}));
let at = view.hand.target;
let row = 0;
let last = performance.now();
function step() {
  const now = performance.now();
  const left = targets[row].map((value, axis) => value - at[axis]);
  const distance = Math.hypot(...left);
  const share = Math.min(1, speed * (now - last) / 1000 / Math.max(distance, 1e-9));
  last = now;
  at = at.map((value, axis) => value + share * left[axis]);
  point(at);
  if (share === 1 && (row += 1) === targets.length) done();
  else setTimeout(step, 8);
}
step();
"""
"""Moves the pointer through targets [m] at a speed [m/s]."""


class Play:
    """A process of `foc_ros play`. Attributes: process; data, the folder of recordings."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.data, self._log = folder / 'data', (folder / 'play.txt').open('w+', encoding='utf-8')
        port = [] if '--port' in arguments else ['--port', '0']
        command = [sys.executable, '-m', 'foc_ros', 'play', '--data', str(self.data), *port, *arguments]
        self.process = subprocess.Popen(command, stdout=self._log, stderr=subprocess.STDOUT)

    @property
    def output(self) -> str:
        return Path(self._log.name).read_text(encoding='utf-8')

    @property
    def url(self) -> str:
        """The address of the page, or nothing while the program has not printed it."""
        found = STARTED.search(self.output)
        return found.group(1) if found else ''

    def stop(self) -> int:
        """Interrupt the process and return its exit code."""
        self.process.terminate()
        try:
            return self.process.wait(30)
        finally:
            self.process.kill()
            self._log.close()


@contextmanager
def play(folder: Path, *arguments: str) -> Iterator[Play]:
    """Run `foc_ros play` within a context, at whose end it is stopped."""
    started = Play(folder, *arguments)
    try:
        until(lambda: started.url or started.process.poll() is not None, 'the address of the page', 100.0)
        assert started.url, started.output
        yield started
    except BaseException:
        started.stop()
        raise
    assert started.stop() == 0, started.output


def until(condition: Callable[[], Any], what: str, seconds: float = 60.0) -> Any:
    """Wait until a condition holds and return its value; fail after a deadline."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline, f'waited {seconds} s for: {what}'
        time.sleep(0.02)
    return value


def has_ended(pid: int) -> bool:
    """Return whether a process has ended: it is gone, or a zombie that nobody has waited for."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] == 'Z'
    except FileNotFoundError:
        return True


def visit(browser: Any, started: Play, width: int = 1280, height: int = 1000, dark: bool = False) -> None:
    """Open the page and wait until it shows predictions."""
    show_address(browser, started.url, width, height, dark)
    wait_for(browser, 'play.view.candidates.length > 0', 'predictions')


def wait_for(browser: Any, expression: str, what: str, seconds: float = 60.0) -> Any:
    return until(lambda: browser.execute_script(f'return {expression}'), what, seconds)


def steer(browser: Any, *targets: tuple[float, float], speed: float = 0.3) -> None:
    """Move the pointer through targets [m]."""
    browser.set_script_timeout(60)
    browser.execute_async_script(STEER, [list(each) for each in targets], speed)


def wait_for_answer(browser: Any) -> None:
    distance = 'Math.hypot(...play.view.hand.position.map((value, axis) => value - play.view.candidates[0].path[0][axis]))'
    wait_for(browser, f'play.view.candidates.length && {distance} < 0.005', 'predictions')


def find_point(browser: Any, position: tuple[float, float]) -> tuple[float, float]:
    """Return the pixel of the window at which a position of the scene [m] is drawn."""
    script = """
        const [x, y] = arguments[0];
        const [low, high, bottom, top] = play.settings.bounds;
        const box = document.getElementById('scene').getBoundingClientRect();
        return [box.left + box.width * (x - low) / (high - low), box.top + box.height * (top - y) / (top - bottom)];
    """
    x, y = browser.execute_script(script, list(position))
    return x, y


def await_layout(browser: Any) -> None:
    """Wait until the scene has stayed where it is for a while: controls that appear move it."""
    place, since = None, time.monotonic()
    while time.monotonic() - since < 0.6:
        if (found := find_point(browser, (0.0, 0.0))) != place:
            place, since = found, time.monotonic()
        time.sleep(0.05)


def tab_to(browser: Any, name: str) -> None:
    for _ in range(60):
        if browser.execute_script('return document.activeElement.id') == name:
            return
        press_keys(browser, '\ue004')
    raise AssertionError(f'{name} cannot be reached by Tab')


def press_keys(browser: Any, *keys: str, hold_s: float = 0.0) -> None:
    """Press keys of the keyboard, one after the other, for a time [s]."""
    from selenium.webdriver import ActionChains

    actions = ActionChains(browser, duration=0)
    for key in keys:
        actions.key_down(key).pause(hold_s).key_up(key)
    actions.perform()
