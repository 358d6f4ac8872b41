# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report page in a browser: it plays, it draws the numbers of predictions.json, and the check finds a broken page."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from browser_helpers import MOVE, check_report, screenshot, show
from report_samples import predictions, samples

from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, collect_obstacles
from foc_ros.reporting.encode import MOST_FRAMES
from foc_ros.reporting.page import Section, write_page
from foc_ros.reporting.report import write_report
from foc_ros.reporting.views import build_hand_trajectory, build_snapshot

WALL = Box((0.2, 0.1), (0.4, 0.02), 0.3, radius=0.01, radius_stddev=0.005)
HOSTILE = '</script><img src=x onerror=alert(1)><b>&amp;'


@pytest.fixture(scope='module')
def report(tmp_path_factory):
    made, directory = samples(2), tmp_path_factory.mktemp('report')
    write_report(
        directory, HOSTILE, build_hand_trajectory(made), [build_snapshot(each) for each in predictions(made)], {HOSTILE: HOSTILE}
    )
    return directory


def test_the_page_shows_the_numbers(browser, report):
    check_report(browser, report)


def test_the_page_draws_outlines_of_boxes_and_circles(browser, tmp_path):
    """A pixel has the colour of an obstacle where the obstacle is, and not elsewhere, up to its border."""
    made = samples()
    shapes = collect_obstacles([Circle((0.15, 0.0), 0.03, 0.003), WALL, Capsule((0.0, 0.1), (0.1, 0.2), radius=0.02)])
    snapshots = [build_snapshot(replace(each, obstacles=shapes)) for each in predictions(made)]
    write_report(tmp_path, 'x', build_hand_trajectory(made), snapshots, {})
    assert show(browser, tmp_path / 'index.html') == []
    points = np.random.default_rng(0).uniform([-0.02, -0.06], [0.32, 0.22], (3000, 2))
    drawn = browser.execute_script(COLOURED, points.tolist())
    depth = (shapes.radius - measure_offsets(points, shapes)[1]).max(axis=1)
    ring = (shapes.radius + shapes.radius_stddev - measure_offsets(points, shapes)[1]).max(axis=1)
    is_clear = np.abs(depth) > 2.5e-3
    np.testing.assert_array_equal(np.array(drawn['disc'])[is_clear], (depth > 0.0)[is_clear])
    assert np.array(drawn['ring'])[(ring > 2.5e-3) & (depth < -2.5e-3)].all()


COLOURED = """
const { scene } = report;
scene.begin();

report.scenes[0].forEach((each) => scene.obstacle({ ...each, name: '' }));
const pen = scene.canvas.getContext('2d');
const channels = (name) => ink(name).match(/[0-9a-f]{2}/gi).map((each) => parseInt(each, 16));
const isAt = ([x, y], colour) => {
  const place = [scene.origin[0] + scene.scale * x, scene.origin[1] - scene.scale * y].map(Math.floor);
  const pixel = pen.getImageData(...place, 1, 1).data;
  return pixel[3] > 0 && colour.every((value, row) => Math.abs(pixel[row] - value) < 3);
};
const [disc, ring] = [channels('--disc'), channels('--ring')];
return { disc: arguments[0].map((point) => isAt(point, disc)), ring: arguments[0].map((point) => isAt(point, ring)) };
"""


@pytest.mark.parametrize('dark', [False, True], ids=['light', 'dark'])
def test_the_page_fits_on_a_phone(browser, report, tmp_path, dark):
    assert show(browser, report / 'index.html', 360, 640, dark) == []
    assert browser.execute_script('return document.documentElement.scrollWidth') == 360
    cut = "return [...document.querySelectorAll('.wide')].filter((each) => each.scrollWidth > each.clientWidth).length"
    assert browser.execute_script(cut) == 0, 'facts are read without moving the table'
    browser.execute_script("""
        for (const row of document.querySelectorAll('#candidates tr[data-track]')) {
          [row.cells[1].textContent, row.cells[4].textContent] = ['100 %', 'goal0: right of 1, right of 2, left of post_3'];
          [row.cells[5].textContent, row.cells[6].textContent] = ['11.81', '0.000 *'];
        }
    """)
    assert browser.execute_script('return document.documentElement.scrollWidth') == 360
    pages = [browser.execute_script('return getComputedStyle(document.body).backgroundColor')]
    picture = screenshot(browser)
    assert picture.startswith(b'\x89PNG') and len(picture) > 20_000
    browser.find_element('id', 'theme').click()
    pages.append(browser.execute_script('return getComputedStyle(document.body).backgroundColor'))
    assert pages == (['rgb(20, 24, 28)', 'rgb(255, 255, 255)'] if dark else ['rgb(255, 255, 255)', 'rgb(20, 24, 28)'])


def test_playing_stops_at_the_end_of_a_movement(browser, report):
    from selenium.webdriver.support.ui import WebDriverWait

    show(browser, report / 'index.html')
    browser.execute_script("document.getElementById('pace').value = '4'; document.getElementById('play').click();")
    ended = "const time = document.getElementById('time'); return time.value === time.max && time.max !== time.min;"
    WebDriverWait(browser, 60).until(lambda opened: opened.execute_script(ended))
    assert browser.find_element('id', 'play').text == '▶'


def test_a_long_recording_says_where_the_slider_stops(browser, tmp_path):
    made = samples(5)
    write_report(tmp_path, 'x', build_hand_trajectory(made), [build_snapshot(each) for each in predictions(made, every=1)], {})
    check_report(browser, tmp_path)
    assert f'{MOST_FRAMES} of the 750 predictions' in browser.find_element('id', 'decimated').text


def test_paths_begin_at_the_hand_and_are_named_in_words_in_the_table_and_under_the_pointer(browser, report):
    show(browser, report / 'index.html')
    choose = "const first = document.getElementById('movement'); first.value = 0; first.dispatchEvent(new Event('change'))"
    browser.execute_script(choose)
    browser.execute_script(MOVE, 0)
    paths = browser.execute_script('return report.scene.paths.map((each) => [each.kind, each.text, each.points])')
    assert [kind for kind, _, _ in paths].count('ghost') == 2
    begins = np.array([points[0] for _, _, points in paths])
    np.testing.assert_allclose(begins, np.tile(begins[0], (len(begins), 1)), atol=2e-4)
    number = browser.execute_script('return report.data.frames[report.state.frame].at')
    known = json.loads((report / 'predictions.json').read_text(encoding='utf-8'))['predictions'][number]
    words = browser.execute_script(
        "return [...document.querySelectorAll('#candidates tr[data-track]')].map((row) => row.cells[4].textContent)"
    )
    assert [text.split('; ')[0] for text in words] == [each['description'] for each in known['candidates']]
    assert any('right of 1' in each for each in words) and any('leads through obstacle post' in each for each in words)
    (goal, *_), letters = browser.execute_script('return [report.scene.goals, report.scene.letters]')
    assert letters and min(np.hypot(*(np.array(letters) - goal['place']).T)) > goal['radius']
    kind, text, points = paths[-1]
    assert (kind, browser.execute_script('return report.scene.find(arguments[0])', points[12])) == ('path', text)
    signs = browser.find_element('id', 'signs').text
    assert all(
        name in signs for name in ('hand before', 'hand later', 'motor noise', 'all uncertainty', 'obstacle', 'goal', 'pale')
    )


def test_a_path_below_one_percent_has_neither_letter_nor_colour(browser, report):
    show(browser, report / 'index.html')
    letter = "return document.querySelector('#candidates .letter')"
    before = browser.execute_script(f'{letter}.style.borderColor')
    assert browser.execute_script(f'{letter}.textContent') != ''
    browser.execute_script("""
        const frame = report.data.frames[report.state.frame];
        const { first, share } = report.data.tracks[frame.candidates[0].track];
        share[frame.at - first] = 0.004;
    """)
    browser.execute_script(MOVE, browser.execute_script('return report.state.frame'))
    assert browser.execute_script(f'{letter}.textContent') == ''
    assert browser.execute_script(f'{letter}.style.borderColor') != before


def test_the_chart_of_speeds_holds_the_lines_of_the_paths_with_letters(browser, report):
    show(browser, report / 'index.html')
    for number in range(0, 40, 8):
        browser.execute_script(MOVE, number)
        found = browser.execute_script("""
            const { charts: { speeds }, state, data } = report;
            const lines = [...speeds.box.querySelectorAll('g[data-name] > path')].map((each) => each.getAttribute('d'));
            return [lines.map((each) => each.split(/[ML]/).slice(1).map((at) => Number(at.split(' ')[1]))), speeds.base];""")
        letters = browser.execute_script("return document.querySelectorAll('#candidates .letter:not(:empty)').length")
        lines, base = found
        assert len(lines) == letters + 2, 'and the hand before and later'
        assert all(6.0 < y <= base + 0.01 for line in lines for y in line)


def test_letters_of_the_chart_of_likelihoods_do_not_lie_over_each_other(browser, report):
    show(browser, report / 'index.html')
    found = browser.execute_script("""
        const times = [...Array(9).keys()];
        const line = (share, letter) => ({ points: times.map((time) => [time, share]), colour: 'red', width: 1, letter });
        const lines = [...'ABCDEFGH'].map((letter) => line(0.02, letter));
        report.charts.likelihoods.draw({ span: [0, 9], top: 1, lines: [line(0.005, 'X'), ...lines, line(0.5, 'Y')], now: 0 });
        return [...document.querySelectorAll('#likelihoods .tag')].map((tag) => {
          const { cx, cy } = tag.querySelector('circle');
          return [tag.textContent, cx.baseVal.value, cy.baseVal.value];
        });""")
    assert [letter for letter, _, _ in found] == ['Y', *'ABCDEFGH'], 'those of the highest lines first, none of one near zero'
    x, y = np.array([place for _, *place in found]).T
    distance = np.hypot(x[:, None] - x, y[:, None] - y)[np.triu_indices(len(x), 1)]
    assert distance.min() >= 16.0


def test_a_wide_table_of_a_study_page_moves_within_its_box_on_a_phone(browser, tmp_path):
    columns = ['', *(f'column {number}' for number in range(12))]
    rows = [['estimator.acceleration_time_s', *(12 * ['0.123'])], ['eta', *(12 * ['kept, because nothing tells its value'])]]
    write_page(tmp_path, 'x.html', 'x', [Section('wide', columns=columns, rows=rows)], (), None)
    assert show(browser, tmp_path / 'x.html', 390, 844) == []
    assert browser.execute_script('return document.documentElement.scrollWidth') == 390
    assert browser.execute_script("const box = document.querySelector('.wide'); return box.scrollWidth > box.clientWidth")
    cells = (
        "return [...document.querySelectorAll('td, th')].map((each) => [each.scrollWidth - each.clientWidth, each.clientHeight])"
    )
    beyond, height = np.array(browser.execute_script(cells)).T
    assert beyond.max() == 0 and height.max() < 90, 'columns are not narrowed to one word'


def test_a_click_on_a_chart_leads_to_its_time_and_the_scene_zooms(browser, report):
    from selenium.webdriver import ActionChains

    show(browser, report / 'index.html')
    chart = browser.find_element('id', 'likelihoods')
    browser.execute_script("arguments[0].scrollIntoView({ block: 'center' })", chart)
    ActionChains(browser).move_to_element_with_offset(chart, 100, 0).click().perform()
    wanted = browser.execute_script('const c = report.charts.likelihoods; return c.timeAt(c.box.clientWidth / 2 + 100)')
    assert float(browser.find_element('id', 'clock').text.removesuffix(' s')) == pytest.approx(wanted, abs=0.05)
    scale = browser.execute_script("""
        const [canvas, before] = [report.scene.canvas, report.scene.scale];
        const box = canvas.getBoundingClientRect();
        const place = { clientX: box.left + 50, clientY: box.top + 50 };
        canvas.dispatchEvent(new WheelEvent('wheel', { deltaY: -1, ctrlKey: true, ...place }));
        const zoomed = report.scene.scale / before;
        canvas.dispatchEvent(new MouseEvent('dblclick'));
        return [zoomed, report.scene.scale / before];
    """)
    assert scale == pytest.approx([1.25, 1.0])
