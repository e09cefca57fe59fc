"""Commands as from a shell."""

from typer.testing import CliRunner

from addb_viewer.commands.cli import app


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])
