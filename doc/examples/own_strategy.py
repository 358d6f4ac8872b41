#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program `foc_ros` with a strategy of one's own: the one of `lv` and `hc` that needs less effort; see extend.md."""

import sys

import foc_ros
from foc_ros.cli.main import main


def solve_cheaper(problems, starts, settings, deadline):
    """Return for each problem the result of lv or hc, whichever is solved with less effort."""
    results = [foc_ros.get_strategy(name)(problems, starts, settings, deadline) for name in ('lv', 'hc')]
    return [
        min(pair, key=lambda result: (result.status is not foc_ros.Status.SOLVED, result.control @ result.control))
        for pair in zip(*results, strict=True)
    ]


# before the program starts, and again in each of its worker processes, which import this file
foc_ros.register_strategy('cheaper', solve_cheaper)

if __name__ == '__main__':
    sys.exit(main())
