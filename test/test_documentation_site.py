# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The web site in a browser: it names project and version, fits its window, is readable in the dark, and needs no network."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from browser_helpers import show

import foc_ros

ROOT = Path(__file__).parents[1]
TOO_WIDE = """
return [...document.querySelectorAll('.content pre, .content dt.sig, .content img')]
  .filter((each) => each.scrollWidth > each.clientWidth + 1 && each.clientWidth).map((each) => each.textContent.slice(0, 60));
"""
LONG_TYPES = ('ndarray[tuple', 'TypeAliasForwardRef', '<factory>', 'dtype[', '~numpy')


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """Return the site that FOC_ROS_SITE names, or else build it from a copy of its sources, without running the examples."""
    if built := os.environ.get('FOC_ROS_SITE'):
        return Path(built)
    for package in ('furo', 'sphinx_gallery'):
        pytest.importorskip(package, reason='the extra `doc` is not installed: make doc installs it')
    root = tmp_path_factory.mktemp('site')
    copied = shutil.ignore_patterns('auto_examples', '__pycache__')
    for name in ('doc', 'examples', 'scripts', 'config', 'test', 'benchmarks', 'launch'):
        shutil.copytree(ROOT / name, root / name, ignore=copied)
    for file in ROOT.glob('*.*'):
        if file.is_file():
            shutil.copy(file, root)
    environment = os.environ | {'PYTHONPATH': os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])}
    options = ['--builder', 'html', '--quiet', '--define', 'sphinx_gallery_conf.plot_gallery=False']
    command = [sys.executable, '-m', 'sphinx', *options, root / 'doc', root / 'html']
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stderr
    return root / 'html'


PAGES = ('index', 'api', 'concepts', 'interfaces', 'parameters', 'auto_examples/index', 'auto_examples/plot_08_replay_bag')


@pytest.mark.timeout(300)
@pytest.mark.parametrize('page', PAGES)
def test_a_page_fits_its_window_and_needs_no_network(site, browser, page):
    for width in (1280, 1440, 1920):
        assert show(browser, site / f'{page}.html', width) == []
        assert browser.execute_script('return document.documentElement.scrollWidth') <= width, f'{width} pixels'
        assert browser.execute_script(TOO_WIDE) == []


def test_the_site_says_what_it_is_about(site, browser):
    show(browser, site / 'index.html')
    assert f'foc_ros {foc_ros.__version__}' in browser.title
    sidebar = browser.find_element('css selector', '.sidebar-drawer').text
    assert f'foc_ros {foc_ros.__version__}' in sidebar
    assert 'Predicts where the hand of a teleoperator is going' in sidebar
    described = browser.find_element('css selector', 'meta[name=description]').get_attribute('content')
    assert 'Predicts where the hand of a teleoperator is going' in described
    assert browser.execute_script("return document.querySelector('.sidebar-logo').naturalWidth") > 0


def test_the_reference_has_the_types_of_the_sources(site, browser):
    show(browser, site / 'api.html')
    signatures = browser.execute_script("return [...document.querySelectorAll('dt.sig')].map((each) => each.textContent)")
    assert len(signatures) > 80
    assert [text for text in signatures if any(long in text for long in LONG_TYPES)] == []
    text = next(text for text in signatures if 'set_obstacles' in text)
    assert 'Obstacles' in text and '→' in text
