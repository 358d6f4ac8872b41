# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings of the documentation web site, which `make doc` builds with Sphinx. The pages can also be read in the repository."""

import re
import sys
from pathlib import Path
from typing import Any

import mathjax  # the files of MathJax, from the package django-static-mathjax; Django is not needed
from docutils import nodes
from sphinx import addnodes

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from foc_ros import __version__

project = 'foc_ros'
release = __version__
author = 'the foc_ros developers'
copyright = f'{author}, Apache-2.0'  # noqa: A001 (the name that Sphinx wants)
description = 'Predicts where the hand of a teleoperator is going among obstacles, with uncertainty and likelihood'

extensions = [
    'myst_parser',
    'numpydoc',
    'sphinx.ext.autodoc',
    'sphinx.ext.mathjax',
    'sphinx_gallery.gen_gallery',
]
exclude_patterns = ['examples', '**/sg_execution_times.rst', 'sg_execution_times.rst']

# links to headings, as repositories make them; formulas between dollar signs
myst_heading_anchors = 4
myst_enable_extensions = ['dollarmath', 'amsmath']
# every link between pages and to files has to lead somewhere; links to the web are not checked
nitpicky = True
# types in docstrings are words such as array_like, and not links
nitpick_ignore_regex = [('py:.*', '.*')]

autodoc_default_options = {'member-order': 'bysource'}
autodoc_typehints = 'signature'
autodoc_typehints_format = 'short'
autodoc_type_aliases = {'ArrayLike': 'ArrayLike'}
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 88
add_module_names = False
numpydoc_show_class_members = False
numpydoc_attributes_as_param_list = True
# single backticks in docstrings are code
default_role = 'code'

sphinx_gallery_conf = {
    'examples_dirs': '../examples',
    'gallery_dirs': 'auto_examples',
    'filename_pattern': r'plot_',
    'within_subsection_order': 'FileNameSortKey',
    'abort_on_example_error': True,
    'download_all_examples': False,
    'show_memory': False,
    'min_reported_time': 1e9,
    'matplotlib_animations': False,
    'remove_config_comments': True,
}

html_theme = 'furo'
html_title = f'foc_ros {release}'
html_logo = 'images/logo.svg'
html_favicon = 'images/logo.svg'
html_context = {'description': description}
myst_html_meta = {'description': f'foc_ros {release}: {description}'}
templates_path = ['_templates']
html_sidebars = {
    '**': [f'sidebar/{part}.html' for part in ('scroll-start', 'brand', 'tagline', 'search', 'navigation', 'scroll-end')],
}
# One file holds the program and the fonts of MathJax. It becomes part of the site, so that formulas need no network.
mathjax_path = 'tex-svg.js'
html_static_path = ['_static', str(Path(mathjax.__path__[0]) / 'static' / 'mathjax' / 'es5' / mathjax_path)]
html_css_files = ['site.css']


def escape_bars(*arguments: object) -> None:
    """Let |U| in a docstring be the size of U, and not a substitution of reStructuredText."""
    lines: list[str] = arguments[-1]  # type: ignore[assignment]
    lines[:] = [line if '``' in line else line.replace('|', '\\|') for line in lines]


LONG_TYPES = {
    r'~?(numpy\.)?ndarray\[tuple\[(~typing\.)?Any, \.\.\.\], ~?(numpy\.)?dtype\[~?(numpy\.)?(\w+)\]\]': r'NDArray[\5]',
    r"TypeAliasForwardRef\('(\w+)'\)": r'\1',
    r'<factory>': '...',
}
"""Types as autodoc writes them, and as NumPy and the sources of foc_ros do; a default that is made for each object."""


def shorten_types(text: str | None) -> str | None:
    """Write the types of a signature as its source does."""
    for long, short in LONG_TYPES.items():
        text = text and re.sub(long, short, text)
    return text


def shorten_signature(*arguments: Any) -> tuple[str | None, str | None]:
    """Write the types of arguments and result as their source does."""
    signature, result = arguments[-2:]
    return shorten_types(signature), shorten_types(result)


def shorten_attributes(_app: object, _domain: str, _kind: str, content: Any) -> None:
    """Write the types of attributes and properties as their source does."""
    for signature in content.parent.findall(addnodes.desc_signature):
        for node in signature.findall(addnodes.desc_annotation):
            text = node.astext()
            if shorten_types(text) != text:
                node.clear()
                node += nodes.Text(shorten_types(text))


def setup(app: Any) -> None:
    """Connect the functions to Sphinx."""
    app.connect('autodoc-process-docstring', escape_bars)
    app.connect('autodoc-process-signature', shorten_signature)
    app.connect('object-description-transform', shorten_attributes)
