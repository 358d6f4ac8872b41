#!/usr/bin/env python3
"""Measure everything that doc/accuracy.md reports, and renew its figures and its blocks of numbers. It takes a few minutes.

python scripts/make_accuracy_figures.py
"""

from __future__ import annotations

from accuracy import algorithm1, bounds, effort_over_eta, guarantee, page, reference

from foc_ros.reporting.plots import save_figure


def main() -> None:
    """Measure one thing after the other, then write the figures and the blocks."""
    outcomes, curves, ends = guarantee.measure(), effort_over_eta.measure(), algorithm1.measure()
    figures = {
        'guarantee': guarantee.draw(outcomes),
        'effort_over_eta': effort_over_eta.draw(),
        'algorithm1': algorithm1.draw(ends),
    }
    for name, figure in figures.items():
        save_figure(figure, page.IMAGES / f'{name}.png')
    texts = {
        'guarantee': guarantee.format_excess(outcomes),
        'outcomes': guarantee.format_statuses(outcomes),
        'curves': effort_over_eta.format_curves(curves),
        'algorithm1': algorithm1.format_ends(ends),
        'reference': reference.format_agreement(),
        'shapes': reference.format_shapes(),
        'bounds': bounds.format_costs(bounds.measure()),
    }
    page.write_blocks(texts)
    for name, text in texts.items():
        print(f'{name}\n{text}\n')


if __name__ == '__main__':
    main()
