"""doc/parameters.md agrees with the configuration."""

import importlib.util
import re
from pathlib import Path

from foc_ros.core.config import list_parameters

ROOT = Path(__file__).parents[1]


def test_the_page_is_current() -> None:
    spec = importlib.util.spec_from_file_location('make_parameter_page', ROOT / 'scripts' / 'make_parameter_page.py')
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert script.PAGE.read_text('utf-8') == script.page(), 'run: python scripts/make_parameter_page.py'
    for parameter in list_parameters():
        assert f'| `{parameter.name}` |' in script.page()


def test_every_parameter_is_read_somewhere() -> None:
    """A parameter that no code reads would be accepted and ignored."""
    code = ' '.join(file.read_text('utf-8') for file in (ROOT / 'foc_ros').rglob('*.py') if file.name != 'config.py')
    unread = [parameter.name for parameter in list_parameters() if not re.search(rf'\.{parameter.name.split(".")[-1]}\b', code)]
    assert unread == []
