# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `simulate` of foc_ros, which here knows the assistance rules of others, too; it prints the same cells.

python benchmarks/assistance.py [--operators A,B] [--assistance A,B] [--trials N] [--seed S] [--params YAML] [--json]
"""

from __future__ import annotations

import sys
from typing import Annotated

from assistance_rules import RIVALS

from foc_ros.cli.main import main
from foc_ros.cli.options import PLAIN, Existing, Operators, Seed, Study, Trials, app, names
from foc_ros.cli.studies import run_simulation

ALL = ('none', 'foc', *RIVALS)

del app['simulate']


@app.command
def simulate(
    *,
    operators: Operators | None = None,
    assistance: Annotated[tuple[str, ...], names(ALL)] = ALL,
    trials: Trials = 20,
    seed: Seed = 0,
    recordings: Existing | None = None,
    study: Study = PLAIN,
) -> int:
    """Compare guidance with the assistance rules of others; the options are those of `foc_ros simulate`."""
    return run_simulation(operators, assistance, trials, seed, recordings, study, RIVALS)


if __name__ == '__main__':
    sys.exit(main(['simulate', *sys.argv[1:]]))
