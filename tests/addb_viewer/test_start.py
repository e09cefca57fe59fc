"""What a command loads before it answers, each in an interpreter of its own."""

import ast
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from typer.main import get_command

import addb_viewer
from addb_viewer.commands.cli import app

HEAVY = {"numpy", "scipy", "sqlalchemy", "viser", "pinocchio", "trimesh", "rerun", "mcap", "ezc3d", "pyarrow"}
OF_A_SOLVE = {"scipy.signal", "scipy.stats", "pinocchio", "viser", "trimesh", "solver.dynamics.dynamics"}


def commands_of(group, before=""):
    """Every command by its words, those of groups too."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands_of(command, f"{before}{name} ")
        else:
            yield f"{before}{name}", command


LISTED = dict(commands_of(get_command(app)))

THEN_LIST = """
import sys
import addb_viewer
from addb_viewer.commands.cli import app
app(sys.argv[1:], standalone_mode=False)
print("\\nloaded", *sys.modules)
"""


def loaded_by(*words):
    out = subprocess.check_output([sys.executable, "-c", THEN_LIST, *map(str, words)], text=True)
    *said, modules = out.splitlines()
    assert modules.startswith("loaded ")
    return "\n".join(said), set(modules.split()[1:])


@pytest.mark.parametrize(
    ("words", "says"),
    [("--version", "addb-viewer "), ("--help", "Usage: "), ("-h", "Usage: "), ("dataset --help", "split")],
)
def test_nothing_heavy_is_loaded_to_say_what_there_is(words, says):
    said, modules = loaded_by(*words.split())
    assert says in said
    assert not modules & HEAVY
    assert not {name for name in modules if name.startswith(("solver", "annotations"))}


def test_a_fit_and_a_subject_without_edits_load_no_database(tmp_path):
    assert "sqlalchemy" not in loaded_by("fit", "--help")[1]
    asked = "import sys; from addb_viewer.jobs.review_store import *; whole_log(Path()); print(*sys.modules)"
    assert "sqlalchemy" not in subprocess.check_output([sys.executable, "-c", asked], cwd=tmp_path, text=True)


def test_reading_flags_loads_no_solver_libraries(tmp_path):
    (tmp_path / "walk.trc").write_text("never read")
    (tmp_path / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    said, modules = loaded_by("flags", tmp_path)
    assert "walk: " in said
    assert not modules & OF_A_SOLVE


@pytest.mark.parametrize("name", LISTED)
def test_a_command_is_listed_as_it_says_itself(name):
    listed = LISTED[name]
    function = getattr(import_module(listed.module), listed.function)
    assert listed.help == inspect.getdoc(function).split("\n\n")[0]
    assert listed.loaded().help == inspect.getdoc(function)


IMPORT = "import sys, addb_viewer; print(*sys.modules)"


def test_importing_the_package_loads_nothing_before_a_name_is_used():
    modules = set(subprocess.check_output([sys.executable, "-c", IMPORT], text=True).split())
    assert not modules & HEAVY
    assert not {name for name in modules if name.startswith(("solver", "annotations", "addb_viewer.api"))}


@pytest.mark.parametrize("name", addb_viewer.__all__)
def test_every_public_name_is_there(name):
    assert getattr(addb_viewer, name) is not None
    assert name in dir(addb_viewer)


def test_a_name_that_is_not_public_is_told_with_those_that_are():
    with pytest.raises(AttributeError, match=r"no attribute 'subject'.*Subject"):
        addb_viewer.subject  # noqa: B018 (asking is the test)


def test_type_checkers_see_the_names_that_the_table_loads():
    source = Path(addb_viewer.__file__).read_text(encoding="utf-8")
    told = {
        alias.asname: node.module
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname
    }
    assert told == {name: getattr(addb_viewer, name).__module__ for name in told}
    assert set(told) == set(addb_viewer.__all__) - {"__version__"}
