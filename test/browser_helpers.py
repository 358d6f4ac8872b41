# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pages in a headless Chromium, and the check that a report page shows the numbers of its report."""

import base64
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

REQUIRED = 'FOC_ROS_REQUIRE_BROWSER'
"""Environment variable that turns a missing browser from a skip into a failure, as in CI."""
SWITCHES = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync', '--disable-dev-shm-usage', '--hide-scrollbars',
)  # fmt: skip


def programs() -> tuple[str, str]:
    """Return the system's Chromium and its driver; skip the test if they are missing, or fail it if they are required."""
    browser = shutil.which('chromium') or shutil.which('chromium-browser') or shutil.which('google-chrome')
    driver = shutil.which('chromedriver')
    if browser is None or driver is None:
        words = 'optional browser: no Chromium with its driver; on Debian: apt install chromium chromium-driver'
        if os.environ.get(REQUIRED):
            pytest.fail(f'{REQUIRED} is set, but {words}')
        pytest.skip(words)
    return browser, driver


@contextmanager
def chromium(profile: Path) -> Iterator[Any]:
    """Yield a browser with a new profile. Nothing is downloaded."""
    webdriver = pytest.importorskip('selenium.webdriver', reason='selenium is not installed')
    browser, driver = programs()
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for switch in (*SWITCHES, f'--user-data-dir={profile}'):
        options.add_argument(switch)
    options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
    opened = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        yield opened
    finally:
        opened.quit()


def show(browser: Any, page: Path, width: int = 1280, height: int = 900, dark: bool = False) -> list[str]:
    return show_address(browser, page.resolve().as_uri(), width, height, dark)


def show_address(browser: Any, address: str, width: int = 1280, height: int = 900, dark: bool = False) -> list[str]:
    """Open a page on a screen of the given size; return the messages of the browser's log."""
    browser.get_log('browser')
    screen = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': width < 500}
    browser.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', screen)
    browser.execute_cdp_cmd('Emulation.setTouchEmulationEnabled', {'enabled': width < 500})
    scheme = {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}
    browser.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': [scheme]})
    browser.get(address)
    return [entry['message'] for entry in browser.get_log('browser')]


def screenshot(browser: Any) -> bytes:
    """Return the whole page as PNG."""
    size = browser.execute_script('return [innerWidth, document.documentElement.scrollHeight]')
    clip = {'x': 0, 'y': 0, 'width': size[0], 'height': size[1], 'scale': 1}
    taken = browser.execute_cdp_cmd('Page.captureScreenshot', {'captureBeyondViewport': True, 'clip': clip})
    return base64.b64decode(taken['data'])


DRAWN = """
const { likelihoods } = report.charts;
return [...document.querySelectorAll('#likelihoods g[data-name]')].map((line) => ({
  points: [...line.querySelectorAll(':scope > circle')].map(({ cx, cy }) => [
    likelihoods.timeAt(cx.baseVal.value), (likelihoods.base - cy.baseVal.value) / (likelihoods.base - 6) * likelihoods.top]),
}));
"""
"""The likelihoods as drawn: positions of the marks, converted from pixels to seconds and likelihoods."""
MOVE = """
const slider = document.getElementById('time');
slider.value = arguments[0];
slider.dispatchEvent(new Event('input'));
return Number(slider.value);
"""
TABLE = """
return [...document.querySelectorAll('#candidates tr[data-track]')].map(
  (row) => [row.cells[3].textContent, Number(row.dataset.share), row.cells[1].textContent]);
"""
PATHS = """
const { canvas, paths } = report.scene;
const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
return [paths.length, new Set(pixels).size];
"""
"""The number of paths that were drawn, and of different values of the pixels."""


def check_report(browser: Any, directory: Path) -> None:
    """Assert that the page of a report works and shows the numbers of predictions.json.

    The browser logs no message and sends no request. The chart shows every likelihood at its position. At every position of the
    slider, the table lists the candidates of that prediction and the scene shows their paths.
    """
    numbers = json.loads((directory / 'predictions.json').read_text(encoding='utf-8'))['predictions']
    assert show(browser, directory / 'index.html') == []
    assert browser.execute_script('return document.body.dataset.ready') == 'yes'
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
    _whole_recording(browser)
    _check_drawn(browser.execute_script(DRAWN), numbers)
    _check_slider(browser, numbers)


def _whole_recording(browser: Any) -> None:
    browser.execute_script(
        "const all = document.getElementById('movement'); all.value = -1; all.dispatchEvent(new Event('change'));"
    )


def _check_drawn(drawn: list[dict[str, Any]], numbers: list[dict[str, Any]]) -> None:
    marks = np.array(sorted(point for line in drawn for point in line['points']))
    wanted = np.array(sorted([each['t_s'], candidate['likelihood']] for each in numbers for candidate in each['candidates']))
    assert marks.shape == wanted.shape
    # A pixel is some milliseconds wide and less than a hundredth high; marks of equal time are sorted by likelihood.
    assert np.abs(np.sort(marks[:, 0]) - np.sort(wanted[:, 0])).max() < 2e-3
    marks[:, 0] = np.sort(wanted[:, 0])
    order = np.lexsort((marks[:, 1], marks[:, 0]))
    assert np.abs(marks[order] - wanted).max() < 2e-3


def _check_slider(browser: Any, numbers: list[dict[str, Any]]) -> None:
    shown = browser.execute_script("return JSON.parse(document.getElementById('report-data').textContent).frames.map(f => f.at)")
    for stop in np.unique(np.linspace(0, len(shown) - 1, 7).round().astype(int)):
        assert browser.execute_script(MOVE, int(stop)) == stop
        wanted = numbers[shown[stop]]
        clock = browser.find_element('id', 'clock').text
        # the page has times with four decimals, of which two are shown: rounded twice
        assert clock.endswith(' s') and abs(float(clock.removesuffix(' s')) - wanted['t_s']) <= 0.0051
        rows = browser.execute_script(TABLE)
        assert [(label, share) for label, share, _ in rows] == [
            (each['label'], each['likelihood']) for each in wanted['candidates']
        ]
        for _, share, text in rows:
            assert abs(float(text.removesuffix(' %').removeprefix('< ')) - 100 * share) <= 0.5
        paths, values = browser.execute_script(PATHS)
        assert paths == len(wanted['candidates']) + len(wanted['unsolved'])
        assert values > 50
