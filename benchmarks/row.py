"""Measure one row in a process of its own and print it as one line of JSON: python benchmarks/row.py NAME [--quick]."""

from __future__ import annotations

import argparse
import json

from catalogue import ROWS


def main() -> None:
    """Measure the row of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('name', choices=ROWS)
    parser.add_argument('--quick', action='store_true')
    chosen = parser.parse_args()
    print(json.dumps(ROWS[chosen.name](chosen.quick).record()))


if __name__ == '__main__':
    main()
