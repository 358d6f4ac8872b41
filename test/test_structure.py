"""Rules for the whole package: at most eight parameters, and no module-level name that needs a glossary of its own."""

import ast
from collections.abc import Iterator
from pathlib import Path

import foc_ros

PACKAGE = Path(foc_ros.__file__).parent
MAX_PARAMETERS = 8
Function = ast.FunctionDef | ast.AsyncFunctionDef

# fmt: off
UNCLEAR_NAMES = {
    'settled', 'Settled', 'settle', 'touching', 'slide', 'pushed', '_pushed', 'between', 'blend', 'place', 'kept',
    'spared', 'entered', 'driven', 'stacked', 'course', 'curve', 'Walker', 'walk', 'continuous', 'least_k', 'assess',
    'led', 'joined', 'gathered', 'united', 'pressing', 'force', 'compliance', 'account', 'asked_for', 'held', 'doubt',
    'unsure', 'lateness', 'waiting', 'partings', 'spread', 'told', 'heard', 'seen', 'Way', 'way', 'Verdict', 'refusals',
    'obstruction', 'rehearse', 'Lanes', 'families', 'tries', 'levels', 'shown', 'moments', 'answers', 'ledger',
    'lineage', 'fixed',
}
# fmt: on
ALLOWED: set[tuple[str, str]] = set()
"""The file of a strategy has the name that users give to the parameter `foc.strategy`."""


def parse_package() -> Iterator[tuple[str, ast.Module]]:
    """Yield the path and the syntax tree of every module."""
    for path in sorted(PACKAGE.rglob('*.py')):
        yield path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text(encoding='utf-8'))


def count_parameters(function: Function) -> int:
    """Return the number of parameters, without `self` and `cls`."""
    given = function.args
    names = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg) if each]
    return len(names) - (names[:1] in (['self'], ['cls']))


def find_module_names(tree: ast.Module) -> Iterator[str]:
    """Yield the functions, classes and variables that a module defines."""
    for node in tree.body:
        if isinstance(node, Function | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            yield from (each.id for each in ast.walk(node) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store))


def test_functions_have_at_most_eight_parameters() -> None:
    counts = {
        f'{path}:{node.lineno} {node.name}': count_parameters(node)
        for path, tree in parse_package()
        for node in ast.walk(tree)
        if isinstance(node, Function)
    }
    too_many = [where for where, count in counts.items() if count > MAX_PARAMETERS]
    assert not too_many, '\n'.join(too_many)


def test_names_of_modules_and_their_contents_are_clear() -> None:
    names = [(path, name) for path, tree in parse_package() for name in (Path(path).stem, *find_module_names(tree))]
    unclear = [f'{path}: {name}' for path, name in names if name in UNCLEAR_NAMES and (path, name) not in ALLOWED]
    assert not unclear, '\n'.join(unclear)
