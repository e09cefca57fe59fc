"""A changed setting reaches what obeys it: no product code makes settings afresh, or falls back on them."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from solver.fitting.settings import Settings, tables

PROJECT = Path(__file__).parents[1]
FAULTS = PROJECT / "solver" / "simulate" / "faults"  # synthetic: no subject's settings are about them
PRODUCT = sorted(
    file
    for package in ("solver", "addb_viewer")
    for file in (PROJECT / package).rglob("*.py")
    if FAULTS not in file.parents
)

# Where defaults are meant, and why.
MADE_HERE = {
    ("solver/fitting/settings.py", "Settings"): "the defaults that a settings.toml changes",
    ("solver/fitting/settings.py", "ReadingSettings"): "put together from the subject's tables",
    ("addb_viewer/commands/describe.py", "Settings"): "prints the defaults",
    ("addb_viewer/report/made_from.py", "Settings"): "what the fit's settings are compared with",
    ("addb_viewer/app/solve/solve_controller.py", "Settings"): "likewise",
    ("addb_viewer/commands/ablation.py", "AblationSettings"): "made of the command's options",
    (
        "solver/simulate/feasible_motion.py",
        "FitSettings",
    ): "of synthetic recordings, which no subject's file changes",
    ("solver/simulate/demo_subject.py", "MeasurementSettings"): "likewise",
    ("addb_viewer/dataset/synthesis/synthetic_subject.py", "MeasurementSettings"): "likewise",
    ("addb_viewer/benchmark/predictors.py", "ContactSettings"): "a baseline is the same for every release",
    ("addb_viewer/benchmark/learnt/predictor.py", "TrainingSettings"): "made of the command's options",
    (
        "solver/kinematics/unnamed/settings.py",
        "KinematicsSettings",
    ): "what naming takes by itself; that the product hands over its own is tested below",
}
FALLS_BACK = {
    (
        "solver/export/conversion/convert.py",
        "read_marker_file",
    ): "files by themselves, which no subject is about"
}

READS_THEM = {"job_for": "where none are handed over, it reads the subject's own"}

CHANGEABLE = {type(table).__name__ for _, table in tables(Settings())} | {"Settings", "ReadingSettings"}


def _name(node: ast.expr | None) -> str:
    if isinstance(node, ast.BinOp):
        return _name(node.left)
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _calls(tree: ast.AST) -> Iterator[ast.Call]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.Call))


def _place(file: Path) -> str:
    return file.relative_to(PROJECT).as_posix()


def _module_names(tree: ast.AST) -> set[str]:
    """What a file imports by name or defines at its top: calls of them are not of something local."""
    nodes = list(ast.iter_child_nodes(tree))
    imported = {alias.name for n in nodes if isinstance(n, ast.ImportFrom) for alias in n.names}
    return imported | {n.name for n in nodes if isinstance(n, ast.FunctionDef)}


def _defines(tree: ast.AST, name: str) -> bool:
    """Whether a settings class and the instance beside it are of this file."""
    return any(isinstance(node, ast.ClassDef) and node.name == name for node in ast.walk(tree))


@pytest.fixture(scope="module")
def trees() -> dict[str, ast.AST]:
    return {_place(file): ast.parse(file.read_text(encoding="utf-8")) for file in PRODUCT}


@pytest.fixture(scope="module")
def made(trees) -> set[tuple[str, str]]:
    return made_afresh(trees)


@pytest.fixture(scope="module")
def fallen_back(trees) -> set[tuple[str, str]]:
    return falling_back(trees)


def made_afresh(trees: dict[str, ast.AST]) -> set[tuple[str, str]]:
    """File and class of every settings object that is made where its class is not defined."""
    return {
        (file, _name(call.func))
        for file, tree in trees.items()
        for call in _calls(tree)
        if _name(call.func).endswith("Settings") and not _defines(tree, _name(call.func))
    } | {
        (file, _name(call.func))
        for file, tree in trees.items()
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for statement in function.body
        for call in _calls(statement)
        if _name(call.func).endswith("Settings")
    }


def _settings_argument(function: ast.FunctionDef) -> tuple[str, int | None] | None:
    """Name and position of the parameter whose settings have a default; None where there is none."""
    positional = [*function.args.posonlyargs, *function.args.args]
    first = len(positional) - len(function.args.defaults)
    options = [(a, i) for i, a in enumerate(positional) if i >= first]
    options += [
        (a, None)
        for a, default in zip(function.args.kwonlyargs, function.args.kw_defaults, strict=True)
        if default is not None
    ]
    for argument, place in options:
        if _name(argument.annotation) in CHANGEABLE:
            return argument.arg, place
    return None


def falling_back(trees: dict[str, ast.AST]) -> set[tuple[str, str]]:
    """File and function of every call of a function without the settings that it has defaults for them."""
    optional = {
        node.name: argument
        for tree in trees.values()
        for node in ast.iter_child_nodes(tree)
        if isinstance(node, ast.FunctionDef)
        and node.name not in READS_THEM
        and (argument := _settings_argument(node))
    }
    found = set()
    for file, tree in trees.items():
        known = _module_names(tree)
        for call in _calls(tree):
            if _name(call.func) not in known or (asked := optional.get(_name(call.func))) is None:
                continue
            name, place = asked
            given = any(k.arg in (name, None) for k in call.keywords)
            given |= place is not None and (
                len(call.args) > place or any(isinstance(a, ast.Starred) for a in call.args)
            )
            if not given:
                found.add((file, _name(call.func)))
    return found


def test_settings_are_made_where_they_are_meant_and_nowhere_else(made):
    assert made == MADE_HERE.keys()


def test_no_call_leaves_out_the_subjects_settings(fallen_back):
    assert fallen_back == FALLS_BACK.keys()


def test_both_ways_of_losing_settings_are_seen():
    tree = ast.parse(
        "def follow(x, settings: KinematicsSettings = KINEMATICS): ...\n"
        "def other(*, settings: KinematicsSettings | None = None): ...\n"
        "def walk(s):\n    follow(1)\n    follow(1, s)\n    other(settings=s)\n    KinematicsSettings()\n"
    )
    assert falling_back({"a.py": tree}) == {("a.py", "follow")}
    assert made_afresh({"a.py": tree}) == {("a.py", "KinematicsSettings")}
