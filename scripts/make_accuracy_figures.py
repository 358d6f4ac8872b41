#!/usr/bin/env python3
"""Measure what doc/accuracy.md reports, and renew its figures and its blocks of numbers. All of it takes an hour or two.

python scripts/make_accuracy_figures.py [PART ...]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

from accuracy import bounds, effort_over_eta, guarantee, page, reference
from matplotlib.figure import Figure

from foc_ros.reporting.plots import save_figure

Blocks = dict[str, str]


def _draw(name: str, figure: Figure) -> None:
    save_figure(figure, page.IMAGES / f'{name}.png')


def measure_guarantee() -> Blocks:
    """Measure what solved movements keep, and how solves end."""
    outcomes = guarantee.measure()
    _draw('guarantee', guarantee.draw(outcomes))
    return {'guarantee': guarantee.format_excess(outcomes), 'outcomes': guarantee.format_statuses(outcomes)}


def measure_curves() -> Blocks:
    """Measure effort over eta."""
    _draw('effort_over_eta', effort_over_eta.draw())
    return {'curves': effort_over_eta.format_curves(effort_over_eta.measure())}


PARTS: dict[str, Callable[[], Blocks]] = {
    'reference': lambda: {'reference': reference.format_agreement(), 'shapes': reference.format_shapes()},
    'guarantee': measure_guarantee,
    'bounds': lambda: {'bounds': bounds.format_costs(bounds.measure())},
    'curves': measure_curves,
}


def main() -> None:
    """Measure one part after the other, and write its figure and its blocks."""
    parser = argparse.ArgumentParser(description='Measure what doc/accuracy.md reports.')
    parser.add_argument('parts', nargs='*', metavar='PART', help=f'some of {", ".join(PARTS)}; all if none is named')
    chosen = parser.parse_args().parts or list(PARTS)
    if unknown := set(chosen) - set(PARTS):
        parser.error(f'no part is named {", ".join(sorted(unknown))}')
    for name in chosen:
        page.write_blocks(PARTS[name]())


if __name__ == '__main__':
    main()
