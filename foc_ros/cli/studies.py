# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands that work on many recordings or trials, or on tables of them; see `commands`."""

from __future__ import annotations

import json as json_format
from dataclasses import replace
from functools import partial
from pathlib import Path

from foc_ros.analysis.simulation import ASSISTANCE, HUMAN_PATHS, OPERATORS
from foc_ros.core.errors import InputError, RecordingError, print_messages
from foc_ros.io.outputs import EVALUATION_PAGE, FIT_PAGE, SIMULATION_PAGE, check_folder, check_new_or_earlier

from . import options
from .options import PLAIN, RECORDINGS, Data, Existing, Study, app


@app.command(group=RECORDINGS)
def learn(data: Data, /, *, output: Path, params: options.Params = options.DEFAULTS, json: options.Json = False) -> int:
    """Write the recordings of a scene as experience for predictions in this scene.

    Parameters
    ----------
    output
        Class library to write, for homotopy.library; an earlier one is replaced.
    """
    from foc_ros.analysis.recordings import find_recordings
    from foc_ros.io.class_library import MOST_WAYS, load_library, save_library

    check_new_or_earlier('--output', output, lambda file: load_library(str(file)))
    recordings = find_recordings(data)
    if len(recordings) > MOST_WAYS:
        raise InputError(f'{data}', f'at most {MOST_WAYS} recordings', len(recordings))
    from foc_ros.analysis.parallel import collect
    from foc_ros.analysis.replay import learn_recording

    movements, failed = collect(partial(learn_recording, config=params), list(recordings.items()), 'learn')
    learnt = [each for found in movements for each in found]
    if not learnt:
        raise RecordingError(f'{data}: no recording could be learnt: {": ".join(next(iter(failed.items())))}')
    save_library(output, learnt)
    words = f'{len(learnt)} movements written to {output}; the parameter homotopy.library names this file for node and replay'
    print(json_format.dumps({'learned': len(learnt), 'failed': failed, 'output': str(output)}) if json else words)
    return print_messages('foc_ros learn', [f'{name}: {reason}' for name, reason in failed.items()])


@app.command(group=RECORDINGS)
def fit(data: Data, /, *, output: Path, allow: options.Allowed = (), study: Study = PLAIN) -> int:
    """Find the parameters that explain recordings best.

    Parameters
    ----------
    output
        Parameter file to write.
    allow
        eta lets values of foc.eta below the given one be taken, with which obstacles are avoided with less certainty; with
        positions, parameters are written even if predicted positions become worse by 5 % and 1 mm.
    """
    from foc_ros.analysis.recordings import find_recordings
    from foc_ros.ros.parameters import load_parameter_file, write_parameter_file

    check_new_or_earlier('--output', output, load_parameter_file)
    study.check(FIT_PAGE)
    recordings = find_recordings(data)
    write_report = study.load_report('fit')
    from foc_ros.analysis.fitting import fit as fitting

    with study.open_workers():
        found = fitting.fit_parameters(recordings, study.params, may_lower_eta='eta' in allow)
    answer = fitting.make_answer(found, study.params, output)
    losses = fitting.find_worse_positions(found.comparison)
    print_messages('foc_ros fit', losses)
    if losses and 'positions' not in allow and not options.confirm(f'Write {output} all the same?'):
        answer['output'] = None
        replace(study, report=None).show(answer, fitting.make_tables(answer), fitting.make_sentences(answer), FIT_PAGE)
        return print_messages('foc_ros fit', [f'{output} is not written; --allow positions writes it all the same'])
    write_parameter_file('--output', output, found.config)
    write_report(data.resolve().name, answer, recordings, found.config)
    study.show(answer, fitting.make_tables(answer), fitting.make_sentences(answer), FIT_PAGE, fitting.list_commands(answer))
    return print_messages('foc_ros fit', [f'{name}: {reason}' for name, reason in found.failed.items()])


@app.command(group=RECORDINGS)
def evaluate(data: Data, /, *, in_order: bool = False, unannounced: bool = False, study: Study = PLAIN) -> int:
    """Compare predictions with recordings of people, beside simple baselines.

    Parameters
    ----------
    in_order
        Replay the recordings of an operator one after the other, with what is learnt from one to the next.
    unannounced
        Replay each recording of tables also with its goal left out of the list, and judge the share of another goal.
    """
    from foc_ros.analysis.recordings import find_recordings

    study.check(EVALUATION_PAGE)
    recordings = find_recordings(data)
    write_report = study.load_report('evaluation')
    from foc_ros.analysis.evaluation import observations, report, scores, truth
    from foc_ros.io.terminal import name_stage

    say = partial(name_stage, stages=('replay', 'compare', 'score', *['without goals'] * unannounced))
    with study.open_workers():
        observed, failed = observations.observe_all(recordings, study.params, in_order, say('replay'))
        print_messages('foc_ros evaluate', [f'{name}: {reason}' for name, reason in failed.items()])
        if not observed:
            print_messages('foc_ros evaluate', [f'none of the {len(failed)} recordings could be evaluated'])
            return 3
        warnings = truth.warn_of_several_movements((each.name, each.path) for each in observed)
        print_messages('foc_ros evaluate', warnings)
        answer = report.evaluate(observed, study.params, say)
        if unannounced:
            without = scores.leave_goals_out(recordings, study.params.plane)
            left_out, _ = observations.observe_all(without, study.params, in_order, say('without goals'))
            answer['other_goal'] = scores.score_other_goal(observed, left_out, study.params.likelihood.other_goal)
            if answer['other_goal'] is None:
                print_messages('foc_ros evaluate', ['no recording has several goals of which one could be left out'])
            else:
                answer['verdict'].append(scores.describe_other_goal(answer['other_goal']))
    mismatches = report.find_label_mismatches(data, observed)
    differ = 'the label differs from the recorded path'
    print_messages('foc_ros evaluate', [f'{name}: {differ}: {words}' for name, words in mismatches.items()])
    answer |= {'failed': failed, 'warnings': warnings, 'labels_not_taken': mismatches}
    write_report(data.resolve().name, answer, recordings, study.params)
    sentences = *answer['verdict'], 'In short:', *report.make_summary(answer)
    study.show(answer, report.make_tables(answer), sentences, EVALUATION_PAGE)
    return 2 if failed else 0


@app.command(group=options.OTHER)
def simulate(
    *,
    operators: options.Operators | None = None,
    assistance: options.Assistance = ASSISTANCE,
    trials: options.Trials = 20,
    seed: options.Seed = 0,
    recordings: Existing | None = None,
    study: Study = PLAIN,
) -> int:
    """Compare simulated operators with and without guidance.

    Parameters
    ----------
    operators
        Some of accurate, noisy, laggy, changes_way, unannounced_goal, human_paths (default: all; human_paths with --recordings
        only).
    assistance
        none, foc or both.
    trials
        Paired trials of each operator.
    seed
        Equal seeds give equal results.
    recordings
        Recordings of people, as for evaluate, for the operator human_paths.
    """
    from foc_ros.analysis.recordings import find_recordings

    study.check(SIMULATION_PAGE)
    operators = operators or (OPERATORS if recordings is not None else OPERATORS[:-1])
    if HUMAN_PATHS in operators and recordings is None:
        raise InputError('--recordings', f'recordings of people for the operator {HUMAN_PATHS}', 'none')
    found = find_recordings(recordings) if recordings is not None and HUMAN_PATHS in operators else {}
    write_report = study.load_report('simulation')
    from foc_ros.analysis.evaluation.scores import warn_of_few
    from foc_ros.analysis.parallel import collect_all
    from foc_ros.analysis.simulation.operators import read_tasks
    from foc_ros.analysis.simulation.study import RULES, make_pairs, make_summary, make_tables, run_pair, summarise

    print_messages('foc_ros simulate', warn_of_few(trials, 'trials of each operator'))
    tasks = read_tasks(found.values(), study.params) if found else []
    with study.open_workers():
        run = partial(run_pair, config=study.params, rules=RULES)
        results = collect_all(run, make_pairs(operators, assistance, trials, seed, tasks), 'simulate')
    cells = summarise(results, seed)
    write_report(cells, results, study.params)
    words = 'none: without guidance; foc: with it; path: how far the hand moved.'
    study.show({'cells': cells, 'seed': seed}, make_tables(cells), (words, 'In short:', *make_summary(cells)), SIMULATION_PAGE)
    return 0


@app.command(group=options.OTHER)
def convert(csv: Existing, /, *, output: Path, obstacles: Existing | None = None, goals: Existing | None = None) -> int:
    """Convert motion capture in CSV tables to bags.

    Parameters
    ----------
    csv
        Recordings: columns recording, t_s, x_m, y_m[, z_m]; or a folder of all tables, as evaluate takes it.
    output
        Directory for the bags, one per recording.
    obstacles
        Columns x_m, y_m, radius_m[, radius_stddev_m, id, z_m, recording], for boxes size_x_m, size_y_m[, yaw_rad].
    goals
        Columns x_m, y_m[, z_m, recording].
    """
    check_folder('--output', output)
    from foc_ros.analysis.recordings import convert_tables

    print(convert_tables(csv, obstacles, goals, output))
    return 0


@app.command(group=options.OTHER, show=False)
def warm_up() -> int:
    """Do nothing any more: the command will be removed."""
    print('there is nothing to do: foc_ros compiles nothing any more')
    return 0
