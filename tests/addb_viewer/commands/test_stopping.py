"""Ctrl-C in the middle of a solve, in a process of its own."""

import signal
import subprocess
import sys
import textwrap

import pytest

from tests.patience import FOR_EVER_S, PATIENCE_S

# A background job starts its children with Ctrl-C ignored; a terminal does not.
SOLVE_THAT_WAITS = """
    import signal, sys, time
    signal.signal(signal.SIGINT, signal.default_int_handler)
    from addb_viewer.commands import cli
    from addb_viewer.jobs import solving

    def solve(*_, progress, **__):
        progress("scaling", 0.1)
        print("solving", flush=True)
        time.sleep(FOR_EVER_S)

    solving.solve = solve
    cli.main()
"""


LOADED_SLOWLY = """
    import runpy, sys, types

    class Slow(types.ModuleType):
        def __getattr__(self, name):
            raise KeyboardInterrupt

    sys.modules[MODULE] = Slow(MODULE)
    sys.argv = ["addb-viewer", "fit", "."]
    runpy.run_module("addb_viewer", run_name="__main__")
"""


@pytest.mark.parametrize("module", ["addb_viewer.commands.cli", "addb_viewer.commands.fit"])
def test_ctrl_c_while_the_libraries_are_loaded_is_no_traceback(module):
    program = textwrap.dedent(LOADED_SLOWLY).replace("MODULE", repr(module))
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert run.returncode == 130
    assert run.stderr == "addb-viewer: stopped; nothing was written\n"


def test_ctrl_c_ends_with_130_and_nothing_written(tmp_path):
    (tmp_path / "walk.trc").write_text("never read")
    (tmp_path / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    before = sorted(tmp_path.rglob("*"))
    program = textwrap.dedent(SOLVE_THAT_WAITS).replace("FOR_EVER_S", str(FOR_EVER_S))
    run = subprocess.Popen(
        [sys.executable, "-c", program, "fit", tmp_path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert run.stdout is not None
    assert run.stdout.readline() == "solving\n"
    run.send_signal(signal.SIGINT)
    _, error = run.communicate(timeout=PATIENCE_S)
    assert run.returncode == 130
    assert error == "addb-viewer: stopped; nothing was written\n"
    assert sorted(tmp_path.rglob("*")) == before
