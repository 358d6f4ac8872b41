# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""doc/parameters.md and config/foc.yaml agree with the configuration; `python test/test_parameter_page.py` renews both."""

import re
from pathlib import Path

import pytest

from foc_ros.core.config import Config, list_parameters
from foc_ros.ros.parameters import dump_parameter_file, load_parameter_file

ROOT = Path(__file__).resolve().parents[1]
PAGE, FILE = ROOT / 'doc' / 'parameters.md', ROOT / 'config' / 'foc.yaml'
LICENCE = '# SPDX-FileCopyrightText: 2026 the foc_ros developers\n# SPDX-License-Identifier: Apache-2.0\n'
REMEDY = 'run: python test/test_parameter_page.py'

HEAD = """# Parameters

Every parameter of the node, of the commands (`--params`) and of `foc_ros.Config`. `python test/test_parameter_page.py` makes this
page from `foc_ros/core/config.py`, and `config/foc.yaml`, which holds the same defaults as a ROS 2 parameter file.
A value outside its range, of the wrong type, or of an unknown name is refused with name, value and bound. Read-only parameters
are set at the start. The node alone also has `autostart` (default true, read-only).
"""

TABLE = """
| parameter | default | range | meaning |
|---|---|---|---|
"""


def page():
    """Return the page: a section for each group, in the order of the configuration."""
    text, group = HEAD, None
    for parameter in list_parameters():
        name = parameter.name.rpartition('.')[0]
        if name != group:
            text += f'\n## {name or "General"}\n\n{_describe_group(name)}\n{TABLE}'
            group = name
        text += _build_row(parameter)
    return text


def _describe_group(group):
    """Return the first sentence of the docstring of a group's class."""
    document = type(getattr(Config(), group) if group else Config()).__doc__ or ''
    return document.strip().splitlines()[0]


def _build_row(parameter):
    """Return the row of a parameter; its unit stands behind its range."""
    bound = parameter.bound
    choices = tuple(bound.choices)
    if choices:
        span = ', '.join(f'`{choice}`' for choice in choices)
    else:
        span = bound.unit if bound.low is None else f'[{bound.low:g}, {bound.high:g}] {bound.unit}'.strip()
    default = f'`{parameter.default}`' if parameter.default != '' else 'empty'
    meaning = bound.meaning + (' (read-only)' if bound.read_only else '')
    return f'| `{parameter.name}` | {default} | {span} | {meaning} |\n'


def test_the_page_is_current():
    assert PAGE.read_text('utf-8') == page(), REMEDY
    for parameter in list_parameters():
        assert f'| `{parameter.name}` |' in page()


def test_the_parameter_file_is_current():
    assert FILE.read_text('utf-8') == LICENCE + dump_parameter_file(Config()), REMEDY


@pytest.mark.parametrize('name', ['free_hand', 'thumb_stick'])
def test_the_parameters_of_the_documentation_can_be_read(name):
    assert load_parameter_file(ROOT / 'doc' / 'examples' / f'{name}.yaml') != Config()


def test_every_parameter_is_read_somewhere():
    """A parameter that no code reads would be accepted and ignored."""
    code = ' '.join(file.read_text('utf-8') for file in (ROOT / 'foc_ros').rglob('*.py') if file.name != 'config.py')
    unread = [parameter.name for parameter in list_parameters() if not re.search(rf'\.{parameter.name.split(".")[-1]}\b', code)]
    assert unread == []


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
    FILE.write_text(LICENCE + dump_parameter_file(Config()), encoding='utf-8')
