"""The documentation as a web site: `make doc`. The pages read as well where they are, on the screen of a repository."""

project = 'foc_ros'
author = 'the foc_ros developers'
copyright = f'{author}, Apache-2.0'  # noqa: A001 (the name that Sphinx wants)

extensions = ['myst_parser']
# links to headings, as repositories make them
myst_heading_anchors = 4
exclude_patterns = ['examples']
# every link between pages and to files has to lead somewhere; those of the web are not asked for
nitpicky = True

html_theme = 'furo'
html_title = 'foc_ros'
