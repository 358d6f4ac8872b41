"""The figures of doc/calibration.md on the recovery of tau and lambda: 20 trials, as a table in Markdown."""

from __future__ import annotations

import sys

from foc_ros.analysis.fitting.trials import trial

TRIALS = 20


def main() -> int:
    """Run the trials and print them."""
    trials = [trial(seed) for seed in range(TRIALS)]
    print('| tau [m^2] | lambda | movements | tau found / true | lambda found / true | recovered |\n|---|---|---|---|---|---|')
    for each in trials:
        ratios = f'{each.found.tau / each.tau:.3f} | {each.found.lam / each.lam:.3f}'
        print(f'| {each.tau:.2e} | {each.lam:.2e} | {each.movements} | {ratios} | {"yes" if each.recovered else "no"} |')
    print(f'\n{sum(each.recovered for each in trials)} of {TRIALS} recovered')
    return 0


if __name__ == '__main__':
    sys.exit(main())
