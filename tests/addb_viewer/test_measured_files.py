"""What was measured is never written over: every output of every command is aimed at every kind of it."""

import re
import shutil
from pathlib import Path

import pytest

from addb_viewer import SolverError, Subject
from addb_viewer.jobs.exporting import Format
from solver.capture.atomic import whole_file, write_whole
from solver.capture.formats.text_exports import ENDINGS, export_of
from solver.capture.subject.measured_files import READ, reason_to_stay
from solver.common.errors import CaptureError
from tests.addb_viewer.shell import run
from tests.addb_viewer.typed import COMMANDS, TYPED

READ_BY = {  # options and arguments whose file is only read
    "file",
    "source",
    "subject",
    "--settings",
    "--forces",
    "--model",
    "--previous",
    "--outside",
    "--start-from",
    "--against",
}
FILES = {"FILE", "PLACE", "OUT"}  # what they are called in the help
OUTPUTS = sorted(
    (name, parameter.opts[0])
    for name, command in COMMANDS.items()
    for parameter in command.params
    if parameter.metavar in FILES and parameter.opts[0] not in READ_BY
)
FOREIGN = {
    **{f"recording{kind}": b"somebody's own" for kind in READ},
    "RECORDING.TRC": b"PathFileType\t4\t(X/Y/Z)\tof.trc\n",
    "empty.trc": b"",
    "motive.csv": b"Format Version,1.23,Take Name,walk\n",
    "nexus.csv": b"Trajectories\n100\n,,LASI\n",
    "qtm.tsv": b"NO_OF_FRAMES\t100\nNO_OF_CAMERAS\t8\n",
    "subject.toml": b'[trials.walk]\nmarkers = "trials/walk/markers.trc"\nreview = "labels.json"\n',
    "settings.toml": b"[trajectory]\nenabled = false\n",
    "_subject.json": b"{}",
    "review.json": b"{}",
    "labels.json": b"{}",
}
WRITES_WHAT_IS_READ = (Format.opensim, Format.b3d, Format.c3d)


# what opens files for itself: drafts, folders of its own, logs that are appended to or must be new
FOR_ITSELF = {
    "addb_viewer/benchmark/evaluating.py",
    "addb_viewer/benchmark/learnt/training_windows.py",
    "addb_viewer/dataset/build.py",
    "addb_viewer/dataset/synthesis/corpus.py",
    "addb_viewer/dataset/build_task.py",
    "addb_viewer/recordings/rerun_program.py",
    "addb_viewer/recordings/rrd_recording.py",
    "addb_viewer/recordings/rrd_server.py",
    "addb_viewer/watch/verdict_log.py",
    "annotations/database.py",
    "annotations/review_json.py",
    "solver/capture/atomic.py",
    "solver/export/conversion/convert.py",
    "solver/fitting/results/store.py",
    "solver/simulate/faults/hidden.py",
}
OPENS_TO_WRITE = re.compile(
    r"""write_(text|bytes)\(|open\([^)\n]*["'][wax]b?\+?["']|savefig\((?!draft|file)"""
)
PROJECT = Path(__file__).parents[2]


@pytest.fixture
def measured(folder):
    """A file of every kind in the subject's folder, and the subject's own recordings."""
    for name, content in FOREIGN.items():
        (folder / name).write_bytes(content)
    return [
        *(folder / name for name in FOREIGN),
        folder / "trials/walk/markers.trc",
        folder / "trials/walk/grf.mot",
    ]


def test_one_place_opens_what_is_written():
    sources = [
        file for room in ("addb_viewer", "annotations", "solver") for file in (PROJECT / room).rglob("*.py")
    ]
    found = {file for file in sources if OPENS_TO_WRITE.search(file.read_text(encoding="utf-8"))}
    assert {file.relative_to(PROJECT).as_posix() for file in found} == FOR_ITSELF


def test_outputs_are_found():
    assert {("record", "--rrd"), ("record", "--mcap"), ("report", "--out"), ("convert", "target")} <= set(
        OUTPUTS
    )
    assert len(OUTPUTS) > 20


@pytest.mark.slow
@pytest.mark.parametrize(("command", "option"), OUTPUTS)
def test_no_output_is_written_over_what_was_measured(measured, folder, tmp_path, command, option):
    words = TYPED[command].format(s=folder, o=tmp_path / "beside").split()
    for file in measured:
        before = file.read_bytes()
        aimed = [*words[:1], file] if option == "target" else [*words, option, file]
        done = run(*command.split(), *aimed)
        assert file.read_bytes() == before, f"{command} {option} {file.name}: {done.output}"
        assert "unexpected" not in done.stderr
        assert done.exit_code or command == "open", done.output


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("to", WRITES_WHAT_IS_READ)
def test_an_export_leaves_alone_what_lies_in_its_folder(folder, tmp_path, to):
    fit, place = Subject.open(folder).last_fit(), tmp_path / "handed over"
    written = fit.export(to, place)
    assert [file for file in written if file.suffix in READ]
    assert fit.export(to, place) == written, "what it has written itself it may write again"
    for file in [file for file in written if file.suffix in READ]:
        ours = file.read_bytes()
        file.write_bytes(b"somebody's own")
        others = {other: other.read_bytes() for other in written}
        with pytest.raises(SolverError, match="stays as it is"):
            fit.export(to, place)
        assert {other: other.read_bytes() for other in written} == others
        file.write_bytes(ours)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("to", [Format.b3d, Format.c3d])
def test_an_export_does_not_replace_what_it_was_fitted_from(folder, tmp_path, to):
    """Whoever wrote that: here it is an export of ours that somebody fits again."""
    recording = Subject.open(folder).last_fit().export(to, tmp_path)[-1]
    if to is Format.b3d:
        recording = recording.rename(tmp_path / "anna.b3d")
    subject = recording if to is Format.b3d else recording.parent.parent
    settings = {"trajectory": {"enabled": False}}
    again = Subject.open(subject, results=tmp_path / "results", settings=settings).fit()
    before = recording.read_bytes()
    with pytest.raises(SolverError, match="is what was fitted"):
        again.export(to, tmp_path)
    assert recording.read_bytes() == before


def test_a_foreign_page_is_not_replaced_by_the_overview(folder, tmp_path):
    root = tmp_path / "lab"
    for name in ("anna", "ben"):
        shutil.copytree(folder, root / name)
    (root / "report.html").write_text("<html>our annual report</html>")
    done = run("report", root)
    assert done.exit_code == 1
    assert "report.html: is there and stays as it is: this program did not write it" in done.stderr
    assert (root / "report.html").read_text() == "<html>our annual report</html>"
    (root / "report.html").unlink()
    assert run("report", root, "--one-page").exit_code == 0
    assert run("report", root, "--one-page").exit_code == 0, "its own page it may write again"


def test_drafts_do_not_take_the_place_of_what_came_meanwhile(tmp_path):
    with pytest.raises(CaptureError, match="stays as it is"):
        _written_too_late(tmp_path / "walk.trc")
    assert (tmp_path / "walk.trc").read_bytes() == b"somebody's own"


def _written_too_late(path):
    with whole_file(path) as file:
        file.write(b"ours")
        path.write_bytes(b"somebody's own")


@pytest.mark.real
def test_text_that_is_read_is_known_as_measured(real_data):
    texts = [file for ending in ENDINGS for file in (real_data / "wild").rglob(f"*{ending}")]
    read = [file for file in texts if export_of(file) is not None]
    assert read
    assert [file for file in read if not reason_to_stay(file)] == []


def test_results_and_other_files_are_replaced(tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "results/fit.json").write_text("{}")
    for name in ("results/model.osim", "figures.json", "table.csv"):
        (tmp_path / name).write_text("an earlier one")
        write_whole(tmp_path / name, "a later one")
        assert (tmp_path / name).read_text() == "a later one"
    assert reason_to_stay(tmp_path / "table.csv") == ""
