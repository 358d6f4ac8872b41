# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands: each signature declares its arguments, each docstring explains them in `--help`.

A command checks its arguments before it imports what computes: that takes seconds.
"""

from __future__ import annotations

import asyncio
import json as json_format
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated

from cyclopts import Parameter

from foc_ros.core.errors import FocError, InputError, print_messages
from foc_ros.io.outputs import REPORT_FILES, check_folder, check_page, check_picture

from .options import DEFAULTS, NO_LEARNING, PREDICT, TRY, Existing, Json, Learning, Params, Port, Remaps, Samples, app


@app.command(group=TRY)
def demo(*, output: Path = Path('demo_output')) -> int:
    """Play the packaged recording to the node and show its predictions.

    Parameters
    ----------
    output
        Directory for bag and report; an earlier demo's are replaced, other files are kept.
    """
    check_folder('--output', output)
    if find_spec('rclpy') is None:
        raise FocError('rclpy is not installed: run `make setup`, or source a ROS 2 installation, or install the extra `ros`')
    # ROS ends the process that imports rclpy where its middleware is not installed
    if name := os.environ.get('RMW_IMPLEMENTATION'):
        tried = subprocess.run([sys.executable, '-c', 'import rclpy'], capture_output=True, check=False, text=True)
        if tried.returncode:
            raise InputError('RMW_IMPLEMENTATION', 'a middleware that is installed', f'{name}: {tried.stderr.strip()}')
    print('Welcome to foc_ros. A recorded hand moves among a box (obstacle 1), three posts (2, 3, 4) and a wall (5);')
    print('the node predicts where it goes, for 20 s. Then open the report:', output / 'report' / 'index.html', flush=True)
    from .demo import perform  # not before: its import takes seconds

    return perform(output)


@app.command(group=TRY)
def play(*, host: str = '127.0.0.1', port: Port = 8420, data: Path = Path('play_data'), params: Params = DEFAULTS) -> int:
    """Steer the hand yourself, on a page in the browser.

    Parameters
    ----------
    host
        Address to serve on: by default this computer only; any other lets everybody there steer the hand.
    port
        Port to serve on; 0: a free one.
    data
        Folder for recordings, reports and fitted parameters.
    """
    from foc_ros.play.address import open_sockets

    check_folder('--data', data)
    sockets = open_sockets(host, port)
    print('foc_ros play: loading ...', flush=True)
    from foc_ros.play.server import serve

    asyncio.run(serve(params, data, host, sockets))
    return 0


@app.command(group=PREDICT)
def node(*arguments: Annotated[str, Parameter(allow_leading_hyphen=True, metavar='--ros-args ...')]) -> int:
    """Run the node.

    Parameters
    ----------
    arguments
        They are passed to ROS, as in --ros-args -r hand_pose:=/PSM1/measured_cp.
    """
    if find_spec('rclpy') is None:
        raise FocError('rclpy is not installed: source a ROS 2 installation, or install the extra `ros`')
    from foc_ros.ros.main import main

    return main(arguments)


@app.command(group=PREDICT)
def solve(scene: Existing, /, *, json: Json = False, monte_carlo: Samples | None = None, plot: Path | None = None) -> int:
    """Solve one scene from a YAML or JSON file.

    Parameters
    ----------
    scene
        YAML or JSON file.
    monte_carlo
        Estimate the probability of avoidance from so many noisy movements.
    plot
        Draw the candidates (PNG, PDF or SVG); a picture that foc_ros drew is replaced.
    """
    from foc_ros.io.scene_file import load_scene

    if plot is not None:
        check_picture('--plot', plot)
    problem = load_scene(scene)
    if plot is not None:
        from foc_ros.reporting.figures import write_picture  # a missing library is reported before the work
    from foc_ros.analysis.solve import describe_rest, make_table, solve_to_values
    from foc_ros.io.terminal import show_table, show_text

    prediction, values = solve_to_values(problem, monte_carlo)
    if plot is not None:
        write_picture(plot, prediction)
    if json:
        print(json_format.dumps(values, allow_nan=False))
    elif prediction.candidates:
        show_table(*make_table(values['candidates']))
    if prediction.most_likely is not None:
        for line in [] if json else describe_rest(prediction):
            show_text(line)
        return 0
    reasons = '; '.join(f'{each.description}: {each.reason}' for each in prediction)
    lost = f'no candidate could be solved: {reasons}' if reasons else 'no path was found between the start and any goal'
    print_messages('foc_ros solve', [lost])
    return 3


@app.command(group=PREDICT)
def replay(
    bag: Existing,
    /,
    *,
    output: Path | None = None,
    report: Path | None = None,
    params: Params = DEFAULTS,
    learning: Learning = NO_LEARNING,
    guidance: bool = False,
    json: Json = False,
    remap: Remaps = (),
) -> int:
    """Compute predictions from a recording, without ROS and without a time limit: the same ones each time.

    Parameters
    ----------
    bag
        Bag directory, or a .mcap or .db3 file.
    output
        New bag for inputs and predictions.
    report
        Folder for a page and its numbers.
    guidance
        Compute guidance as well, at guidance.rate_hz: into the output bag and, with --json, as a list `guidance`.
    remap
        Take an input from a topic, as in hand_pose:=/PSM1/measured_cp (default: by name, else by type).
    """
    from foc_ros.io.bags import check_bag, check_new_bag

    if report is not None:
        check_page('--report', report, *REPORT_FILES)
    learning.check(params)
    check_bag(bag)
    if output is not None:
        check_new_bag(output)
    from foc_ros.analysis.replay import GuidanceReplay, Replay, Summary, facts, replay_to
    from foc_ros.io.bags import BagReader
    from foc_ros.io.class_library import extend_library
    from foc_ros.io.terminal import show_address, show_table
    from foc_ros.ros.parameters import write_parameter_file

    if report is not None:
        from foc_ros.reporting.report import ReportCollector
    played, summary = Replay(learning.prepare(params)), Summary()
    collector = None if report is None else ReportCollector(params)
    consumers = [summary.add, *([] if collector is None else [collector.add])]
    # The answers wait in files: nothing is printed of a recording that turns out to be damaged.
    with TemporaryFile('w+', encoding='utf-8') as predictions, TemporaryFile('w+', encoding='utf-8') as updates:
        with BagReader(bag, dict(remap)) as reader:
            guiding = GuidanceReplay(played.pipeline) if guidance else None
            replay_to(reader, played, consumers, guiding, output, *((predictions, updates) if json else ()))
            answer = summary.answer(played.intake.counts, reader.duration_s)
        if learning.learn is not None:
            answer['learned'] = extend_library(learning.learn, played.pipeline.learnt.movements.finish().learnt)
        if learning.operator is not None:
            write_parameter_file('--operator', learning.operator, played.pipeline.adapted_config)
        if report is not None and collector is not None:
            collector.write(report, bag.resolve().name, facts(answer))
        if json:
            print(f'{{"summary": {json_format.dumps(answer)}', end='')
            for name, part in (('predictions', predictions), ('guidance', updates))[: 1 + guidance]:
                print(f', "{name}": [', end='')
                part.seek(0)
                shutil.copyfileobj(part, sys.stdout)
                print(']', end='')
            print('}')
        else:
            show_table(('', str(bag)), facts(answer).items())
            if report is not None:
                show_address(report / 'index.html')
    losses = list(filter(None, [played.describe_losses(), played.intake.describe_still_hand()]))
    if summary.counts['solved']:
        print_messages('foc_ros replay', losses)
        return 0
    reason = '; '.join([*losses, played.pipeline.not_ready_reason() or 'see the candidates not solved'])
    print_messages('foc_ros replay', [f'no prediction has a solved candidate: {reason}'])
    return 3
