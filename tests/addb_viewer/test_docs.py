"""Every command and option stands in docs/command-line.md, in its command's section, and no other does."""

import re
from pathlib import Path

import pytest
from typer.main import get_command

from addb_viewer.commands.cli import app
from tests.addb_viewer.typed import COMMANDS

PAGE = (Path(__file__).parents[2] / "docs" / "command-line.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## ([\w ]+)\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S))


def options(command):
    """Long names of a command's options, but for --help, which the page explains once."""
    names = {name for parameter in command.params for name in parameter.opts if name.startswith("--")}
    return names - {"--help"}


def test_every_command_has_its_section():
    assert set(COMMANDS) <= set(SECTIONS)
    for name in COMMANDS:
        assert f"addb-viewer {name}" in SECTIONS[name]


@pytest.mark.parametrize("name", COMMANDS)
def test_the_section_names_the_options_that_there_are(name):
    table = "\n".join(line for line in SECTIONS[name].splitlines() if line.startswith("| `"))
    documented = set(re.findall(r"`(--[a-z0-9-]+)", table))
    assert documented == options(COMMANDS[name])


def test_the_options_of_the_program_itself():
    for name in options(get_command(app)):
        assert name in PAGE
