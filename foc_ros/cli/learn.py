"""`learn`: write the recordings of a scene as a class library, from which predictions in this scene learn."""

from __future__ import annotations

import argparse
import json
import sys

from foc_ros.analysis.learn_demonstrations import learn_recording
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.errors import FocError, InputError, RecordingError
from foc_ros.io.class_library import MOST_WAYS, save_library
from foc_ros.io.terminal import show_progress


def run(arguments: argparse.Namespace) -> int:
    """Learn all recordings and write the library; return 2 where a recording could not be used, and the others were."""
    recordings, output = arguments.found, arguments.output
    if len(recordings) > MOST_WAYS:
        raise InputError(f'{arguments.data}', f'at most {MOST_WAYS} recordings', len(recordings))
    learnt, failed = list[Demonstration](), dict[str, str]()
    for name, recording in show_progress(recordings.items(), 'learn', len(recordings)):
        try:
            learnt.extend(learn_recording(recording, arguments.config))
        except FocError as error:
            failed[name] = str(error)
    if not learnt:
        raise RecordingError(f'{arguments.data}: no recording could be learnt: {next(iter(failed.values()))}')
    save_library(output, learnt)
    if arguments.json:
        print(json.dumps({'learned': len(learnt), 'failed': failed, 'output': str(output)}))
    else:
        print(f'{len(learnt)} movements written to {output}; the parameter homotopy.library names this file for node and replay')
    for reason in failed.values():
        print(f'foc_ros learn: {reason}', file=sys.stderr)
    return 2 if failed else 0
