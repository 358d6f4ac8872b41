#!/usr/bin/env python3
"""Measure what doc/accuracy.md tells, and renew its pictures and the blocks of numbers in it: a few minutes.

python scripts/make_accuracy_figures.py

The ten reference cases are measured where the optional folder `shared` lies beside the checkout; else their block stays as it is.
"""

from __future__ import annotations

from accuracy import guarantee, literal, over_eta, page, reference

from foc_ros.reporting.plots import save


def main() -> None:
    """Measure everything, one part after the other."""
    kept, curves, stepped, agreement = guarantee.measure(), over_eta.measure(), literal.measure(), reference.text()
    for name, figure in {
        'guarantee': guarantee.figure(kept),
        'effort_over_eta': over_eta.figure(),
        'algorithm1': literal.figure(stepped),
    }.items():
        save(figure, page.IMAGES / f'{name}.png')
    texts = {
        'guarantee': guarantee.text(kept),
        'outcomes': guarantee.outcomes(kept),
        'curves': over_eta.text(curves),
        'algorithm1': literal.text(stepped),
    }
    if agreement is None:
        print('the reference cases are absent: their block stays as it is')
    else:
        texts['reference'] = agreement
    page.write(texts)
    for name, text in texts.items():
        print(f'{name}\n{text}\n')


if __name__ == '__main__':
    main()
