#!/usr/bin/env python3
"""The program `foc_ros` with a strategy of one's own: the one of `lv` and `hc` that needs less effort; see extending.md."""

import sys

import foc_ros
from foc_ros.cli.main import main


def solve_cheaper(problem, start, settings, deadline):
    """Return the result of lv or hc, whichever is solved with less effort."""
    results = [foc_ros.get_strategy(name)(problem, start, settings, deadline) for name in ('lv', 'hc')]
    solved = [result for result in results if result.status is foc_ros.Status.SOLVED]
    return min(solved or results, key=lambda result: result.control @ result.control)


# before the program starts, and again in each of its worker processes, which import this file
foc_ros.register_strategy('cheaper', solve_cheaper)

if __name__ == '__main__':
    sys.exit(main())
