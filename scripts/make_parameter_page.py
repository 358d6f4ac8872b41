"""Write doc/parameters.md from the configuration: `python scripts/make_parameter_page.py`."""

from __future__ import annotations

from pathlib import Path

from foc_ros.core.config import Config, Parameter, list_parameters

PAGE = Path(__file__).parents[1] / 'doc' / 'parameters.md'

HEAD = """# Parameters

Every parameter of the node, of the commands (`--params`) and of `foc_ros.Config`. This page is made from
`foc_ros/core/config.py` by `scripts/make_parameter_page.py`; `config/foc.yaml` holds the same defaults as a ROS 2 parameter file.
A value outside its range, of the wrong type, or of an unknown name is refused with name, value and bound. Read-only parameters
are set at the start. The node alone also has `autostart` (default true, read-only).
"""

TABLE = """
| parameter | default | range | meaning |
|---|---|---|---|
"""


def page() -> str:
    """Return the page: a section for each group, in the order of the configuration."""
    text, group = HEAD, None
    for parameter in list_parameters():
        name = parameter.name.rpartition('.')[0]
        if name != group:
            text += f'\n## {name or "General"}\n\n{_describe_group(name)}\n{TABLE}'
            group = name
        text += _build_row(parameter)
    return text


def _describe_group(group: str) -> str:
    """Return the first sentence of the docstring of a group's class."""
    document = type(getattr(Config(), group) if group else Config()).__doc__ or ''
    return document.strip().splitlines()[0]


def _build_row(parameter: Parameter) -> str:
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


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
