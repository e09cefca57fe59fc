"""The version stands in pyproject.toml; whatever else says it agrees."""

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from solver.capture.capture import Subject
from solver.fitting.provenance import provenance_of

ROOMS = ("solver", "annotations", "addb_viewer")
PROJECT = Path(__file__).resolve().parent.parent
STATED = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]


def test_the_installed_program_says_it():
    assert version("addb-viewer") == STATED
    assert CliRunner().invoke(app, ["--version"]).output.strip() == f"addb-viewer {STATED}"


def test_a_citation_names_it():
    citation = (PROJECT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, re.M) == [STATED]


def test_results_say_which_version_made_them(tmp_path):
    assert provenance_of(Subject(tmp_path, ()), [])["addb-viewer"] == STATED


def test_no_code_states_it_again():
    files = [path for room in ROOMS for path in (PROJECT / room).rglob("*.py")]
    assert len(files) > 100
    quoted = (f'"{STATED}"', f"'{STATED}'")
    assert [path for path in files if any(text in path.read_text("utf-8") for text in quoted)] == []
