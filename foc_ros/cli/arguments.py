"""The arguments of every command. Nothing that computes is imported here, so that a wrong argument is answered at once."""

from __future__ import annotations

import argparse
import os
import re
from pathlib import Path

from foc_ros.analysis.simulation.names import ASSISTANCE, OPERATORS
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, RecordingError, collect_all, suggest
from foc_ros.io.topics import TYPES
from foc_ros.ros.parameters import load_parameter_file

MOST_SAMPLES, MOST_TRIALS, MOST_WORKERS = 10_000_000, 100_000, 1024
DATA = 'folder of bags, or of recordings.csv, goals.csv and, where there are obstacles, obstacles.csv'
HOST, PORT, LARGEST_PORT = '127.0.0.1', 8420, 65535
ALLOWED = ('eta', 'positions')
"""What `fit` lowers or makes worse only if it is allowed to."""
_ADDRESS = re.compile(r'(\w+://)?[^\s/]+:\d{1,5}')


def add_demo_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `demo`."""
    words = "directory for bag and report (default: %(default)s); an earlier demo's are replaced, other files are kept"
    parser.add_argument('--output', type=Path, default=Path('demo_output'), metavar='DIR', help=words)


def add_node_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare no arguments: rclpy parses them."""
    parser.usage = '%(prog)s [-h] [--ros-args ...]'


def add_solve_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `solve`."""
    parser.add_argument('scene', type=_read_existing_path, metavar='SCENE', help='YAML or JSON file')
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    words = 'estimate the probability of avoidance from N noisy movements'
    parser.add_argument('--monte-carlo', type=_WholeNumber('--monte-carlo', 1, MOST_SAMPLES), metavar='N', help=words)
    words = 'draw the candidates (PNG, PDF or SVG); a picture that foc_ros drew is replaced'
    parser.add_argument('--plot', type=Path, metavar='FILE', help=words)


def add_replay_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `replay`."""
    parser.add_argument('bag', type=_read_existing_path, metavar='BAG', help='bag directory, or a .mcap or .db3 file')
    parser.add_argument('--output', type=Path, metavar='NEW_BAG', help='write inputs and predictions to a new bag')
    parser.add_argument('--report', type=Path, metavar='DIR', help='write a page with pictures')
    _add_parameter_file(parser)
    words = 'learn the movements, with experience.learning, and add them to this class library, for homotopy.library'
    parser.add_argument('--learn', type=Path, metavar='FILE', help=words)
    words = 'write the parameters with the durations of this operator, for --params'
    parser.add_argument('--operator', type=Path, metavar='FILE', help=words)
    words = 'compute guidance as well, at guidance.rate_hz: into the output bag and, with --json, as a list `guidance`'
    parser.add_argument('--guidance', action='store_true', help=words)
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    words = 'take an input from a topic, as in hand_pose:=/PSM1/measured_cp (default: by name, else by type)'
    parser.add_argument('--remap', action='append', type=_read_remap, default=[], metavar='INPUT:=TOPIC', help=words)


def add_learn_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `learn`."""
    parser.add_argument('data', type=_read_existing_path, metavar='DATA', help=DATA)
    words = 'class library to write, for homotopy.library; an earlier one is replaced'
    parser.add_argument('--output', type=Path, metavar='LIBRARY', required=True, help=words)
    _add_parameter_file(parser)
    parser.add_argument('--json', action='store_true', help='print one JSON object')


def add_fit_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `fit`."""
    parser.add_argument('data', type=_read_existing_path, metavar='DATA', help=DATA)
    parser.add_argument('--output', type=Path, metavar='YAML', required=True, help='parameter file to write')
    _add_parameter_file(parser)
    words = (
        'eta: values of foc.eta below the given one, with which obstacles are avoided with less certainty, may be taken; '
        'positions: parameters with which predicted positions become worse are written'
    )
    parser.add_argument('--allow', type=_Names('--allow', ALLOWED), default=(), metavar='A,B', help=words)
    _add_evaluation_arguments(parser)


def add_evaluate_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `evaluate`."""
    parser.add_argument('data', type=_read_existing_path, metavar='DATA', help=DATA)
    words = 'replay the recordings of an operator one after the other, with what is learnt from one to the next'
    parser.add_argument('--in-order', action='store_true', help=words)
    _add_parameter_file(parser)
    _add_evaluation_arguments(parser)


def add_simulate_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `simulate`."""
    words = f'some of the simulated operators {", ".join(OPERATORS)} (default: all; human_paths with --recordings only)'
    parser.add_argument('--operators', type=_Names('--operators', OPERATORS), metavar='A,B', help=words)
    names = _Names('--assistance', ASSISTANCE)
    words = f'some of the assistance rules {", ".join(ASSISTANCE)} (default: all)'
    parser.add_argument('--assistance', type=names, default=ASSISTANCE, metavar='A,B', help=words)
    number = _WholeNumber('--trials', 1, MOST_TRIALS)
    parser.add_argument('--trials', type=number, default=20, metavar='N', help='paired trials of each operator (default: 20)')
    number = _WholeNumber('--seed', 0, MOST_TRIALS)
    parser.add_argument('--seed', type=number, default=0, metavar='S', help='equal seeds give equal results (default: 0)')
    words = 'recordings of people, as for evaluate, for the operator human_paths'
    parser.add_argument('--recordings', type=_read_existing_path, metavar='DATA', help=words)
    _add_parameter_file(parser)
    _add_evaluation_arguments(parser)


def add_play_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `play`."""
    words = 'address to serve on (default: %(default)s, this computer only); any other lets everybody there steer the hand'
    parser.add_argument('--host', default=HOST, metavar='HOST', help=words)
    number = _WholeNumber('--port', 0, LARGEST_PORT)
    parser.add_argument('--port', type=number, default=PORT, metavar='PORT', help='port (default: %(default)s; 0: a free one)')
    parser.add_argument('--no-ros', action='store_true', help='predict with the library, without a node and DDS')
    words = 'folder for recordings, reports and fitted parameters (default: %(default)s)'
    parser.add_argument('--data', type=Path, default=Path('play_data'), metavar='DIR', help=words)
    _add_parameter_file(parser)


def add_convert_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `convert`."""
    words = 'recordings: columns recording, t_s, x_m, y_m[, z_m]; or a folder of all tables, as evaluate takes it'
    parser.add_argument('csv', type=_read_existing_path, metavar='CSV', help=words)
    words = 'columns x_m, y_m, radius_m[, radius_stddev_m, id, z_m, recording], for boxes size_x_m, size_y_m[, yaw_rad]'
    parser.add_argument('--obstacles', type=_read_existing_path, metavar='CSV', help=words)
    parser.add_argument('--goals', type=_read_existing_path, metavar='CSV', help='columns x_m, y_m[, z_m, recording]')
    parser.add_argument('--output', type=Path, metavar='DIR', required=True, help='directory for the bags, one per recording')


def add_warm_up_arguments(_: argparse.ArgumentParser) -> None:
    """Declare no arguments."""


def _add_parameter_file(parser: argparse.ArgumentParser) -> None:
    words = "the node's parameter file (default: every parameter has its default)"
    parser.add_argument('--params', dest='config', type=load_parameter_file, default=Config(), metavar='YAML', help=words)


def _add_evaluation_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare output and workers of the commands that work on many recordings or trials."""
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    parser.add_argument('--report', type=Path, metavar='DIR', help='write a page with plots')
    add_worker_arguments(parser)


def add_worker_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare `--workers` and `--scheduler`, which `foc_ros.analysis.parallel.open_executor` uses."""
    group = parser.add_mutually_exclusive_group()
    words = 'worker processes (default: one for each core that this process may use)'
    number, cores = _WholeNumber('--workers', 1, MOST_WORKERS), len(os.sched_getaffinity(0))
    group.add_argument('--workers', type=number, default=cores, metavar='N', help=words)
    words = 'use the workers of this Dask scheduler instead (extra: cluster)'
    group.add_argument('--scheduler', type=_read_address, metavar='ADDRESS', help=words)


class _WholeNumber:
    """Converts the text of an option to a whole number in [low, high]."""

    def __init__(self, option: str, low: int, high: int) -> None:
        self._option, self._low, self._high = option, low, high

    def __call__(self, text: str) -> int:
        """Return the number; raise InputError for another text."""
        value = int(text) if text.removeprefix('-').isdecimal() and len(text) < 20 else None
        if value is None or not self._low <= value <= self._high:
            raise InputError(self._option, f'a whole number in [{self._low}, {self._high}]', text)
        return value


class _Names:
    """Converts the text of an option, names with commas between them, to these names."""

    def __init__(self, option: str, known: tuple[str, ...]) -> None:
        self._option, self._known = option, known

    def __call__(self, text: str) -> tuple[str, ...]:
        """Return the names, each once; raise InputError for unknown ones."""
        return tuple(collect_all(self._read_name, [(name,) for name in dict.fromkeys(text.split(','))]))

    def _read_name(self, name: str) -> str:
        if name not in self._known:
            raise InputError(self._option, f'names of {", ".join(self._known)}{suggest(name, self._known)}', name)
        return name


def _read_address(text: str) -> str:
    if not _ADDRESS.fullmatch(text):
        raise InputError('--scheduler', 'the address of a Dask scheduler, as in tcp://host:8786', text)
    return text


def _read_remap(text: str) -> tuple[str, str]:
    """Return the name of an input and the topic from which it is taken."""
    role, separator, topic = text.partition(':=')
    if not separator or not topic:
        raise InputError('--remap', 'INPUT:=TOPIC', text)
    if role not in TYPES:
        raise InputError('--remap', f'one of the inputs {", ".join(TYPES)}{suggest(role, TYPES)}', role)
    return role, topic


def _read_existing_path(text: str) -> Path:
    if not Path(text).exists():
        raise RecordingError(f'{text}: no such file or directory')
    return Path(text)
