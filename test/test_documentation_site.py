# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The web site that `make doc` has built, in a browser: it names project and version, fits its window, and needs no network."""

from pathlib import Path

import pytest
from browser_helpers import show

import foc_ros

SITE = Path(__file__).parents[1] / 'build' / 'doc'
if not (SITE / 'index.html').is_file():
    pytest.skip('the web site is not built: make doc builds it', allow_module_level=True)

TOO_WIDE = """
return [...document.querySelectorAll('.content pre, .content dt.sig, .content img')]
  .filter((each) => each.scrollWidth > each.clientWidth + 1 && each.clientWidth).map((each) => each.textContent.slice(0, 60));
"""
LONG_TYPES = ('ndarray[tuple', 'TypeAliasForwardRef', '<factory>', 'dtype[', '~numpy')
PAGES = ('index', 'api', 'concepts', 'interfaces', 'parameters', 'auto_examples/index', 'auto_examples/plot_08_replay_bag')


@pytest.mark.parametrize('page', PAGES)
def test_a_page_fits_its_window_and_needs_no_network(browser, page):
    for width in (1280, 1440, 1920):
        assert show(browser, SITE / f'{page}.html', width) == []
        assert browser.execute_script('return document.documentElement.scrollWidth') <= width, f'{width} pixels'
        assert browser.execute_script(TOO_WIDE) == []


def test_the_site_says_what_it_is_about(browser):
    show(browser, SITE / 'index.html')
    assert f'foc_ros {foc_ros.__version__}' in browser.title
    sidebar = browser.find_element('css selector', '.sidebar-drawer').text
    assert f'foc_ros {foc_ros.__version__}' in sidebar
    assert 'Predicts where the hand of a teleoperator is going' in sidebar
    described = browser.find_element('css selector', 'meta[name=description]').get_attribute('content')
    assert 'Predicts where the hand of a teleoperator is going' in described
    assert browser.execute_script("return document.querySelector('.sidebar-logo').naturalWidth") > 0


def test_the_reference_has_the_types_of_the_sources(browser):
    show(browser, SITE / 'api.html')
    signatures = browser.execute_script("return [...document.querySelectorAll('dt.sig')].map((each) => each.textContent)")
    assert len(signatures) > 80
    assert [text for text in signatures if any(long in text for long in LONG_TYPES)] == []
    text = next(text for text in signatures if 'set_obstacles' in text)
    assert 'Obstacles' in text and '→' in text
