"""Nothing but `fit` replaces the kept fit: every command and method is run on one that is out of date."""

import shutil
from contextlib import suppress

import pytest

import addb_viewer
from addb_viewer import Fit, ReviewError, SolverError, Subject
from addb_viewer.jobs.stored_solves import stored_solves
from tests.addb_viewer.conftest import MARKERS_ALONE
from tests.addb_viewer.shell import run
from tests.addb_viewer.typed import COMMANDS, TYPED

# what these need is not there: another reviewer, a table, a cause, a shared database
NEED_MORE = {"accept", "agreement", "label", "redo", "reject", "share"}
OF_THE_KEPT_FIT = {"export", "record", "report"}

METHODS = {
    "accept": lambda s: s.accept(),
    "analog": lambda s: s.analog("walk"),
    "clear": lambda s: s.clear("walk", 10, 20),
    "demo": lambda s: Subject.demo(s.folder, trials=()),
    "diagnose": lambda s: s.diagnose(),
    "fit": lambda s: s.fit(["walk"]),
    "flag": lambda s: s.flag("walk", 10, 20),
    "from_arrays": lambda s: Subject.from_arrays(*_one(s), folder=s.folder),
    "from_recordings": lambda s: Subject.from_recordings({"walk": s.recording("walk")}, folder=s.folder),
    "last_fit": lambda s: s.last_fit(),
    "open": lambda s: Subject.open(s.folder),
    "recording": lambda s: s.recording("walk"),
    "reject": lambda s: s.reject(),
    "undo": lambda s: s.undo("walk"),
}
OF_A_FIT = {
    "by_cycle": lambda f: f.by_cycle("coordinates", "knee_angle_r"),
    "export": lambda f: f.export("csv"),
    "report": lambda f: f.report(),
    "to_pandas": lambda f: f.to_pandas(),
    "to_polars": lambda f: f.to_polars(),
    "torque_covariance": lambda f: _refused(lambda: f.torque_covariance("walk", 0)),
}
IN_MEMORY = {
    "Acceptance",
    "Cause",
    "CycleCurves",
    "Diagnosis",
    "FittedTrial",
    "Plate",
    "Recording",
    "Series",
    "Table",
}


def _refused(ask):
    with pytest.raises(SolverError):
        ask()


def _one(subject):
    recording = subject.recording("walk")
    return recording.markers, recording.marker_names, recording.times


@pytest.fixture
def stale(folder):
    """Out of date in every way: other settings, another flag, and half of a trial's file."""
    cut(folder)
    (folder / "settings.toml").write_text(MARKERS_ALONE + "[kinematics]\niterations = 31\n")
    Subject.open(folder).flag("walk", 200, 240, author="anna")
    return folder


def cut(folder):
    markers = folder / "trials/squat/markers.trc"
    markers.write_bytes(markers.read_bytes()[: markers.stat().st_size // 2])


def kept(folder):
    """Every byte of the kept fit."""
    results = folder / "results"
    files = [results / "fit.json", *results.glob("solve-*/**/*")]
    return {path.relative_to(results).as_posix(): path.read_bytes() for path in files if path.is_file()}


def methods(kind):
    return {name for name in dir(kind) if not name.startswith("_") and callable(getattr(kind, name))}


def test_every_command_and_method_is_looked_at():
    assert set(COMMANDS) == set(TYPED)
    assert methods(Subject) == set(METHODS)
    assert methods(Fit) == set(OF_A_FIT)
    kinds = {name for name in addb_viewer.__all__ if isinstance(getattr(addb_viewer, name), type)}
    errors = {name for name in kinds if issubclass(getattr(addb_viewer, name), Exception)}
    assert kinds == IN_MEMORY | errors | {"Fit", "Subject"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", sorted(set(TYPED) - {"fit", "watch"})
)  # that never ends; its own tests look
def test_no_command_but_fit_touches_the_kept_fit(stale, tmp_path, command):
    before = kept(stale)
    words = TYPED[command].format(s=stale, o=tmp_path / "beside").split()
    done = run(*command.split(), *words)
    assert "unexpected" not in done.stderr
    if command not in NEED_MORE and " " not in command:
        assert done.exit_code == 0, done.output
    assert kept(stale) == before
    if command in OF_THE_KEPT_FIT:
        (line,) = done.stderr.splitlines()
        assert "is out of date (trials/squat/markers.trc, the settings), and used all the same" in line
        assert "`addb-viewer fit` renews it" in line


@pytest.mark.slow
@pytest.mark.parametrize("method", sorted(METHODS))
def test_no_method_touches_the_kept_fit(stale, method):
    before = kept(stale)
    with suppress(SolverError, ReviewError):
        METHODS[method](Subject.open(stale))
    assert kept(stale) == before


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("method", sorted(OF_A_FIT))
def test_no_method_of_a_fit_touches_the_kept_one(stale, method):
    before = kept(stale)
    OF_A_FIT[method](Subject.open(stale).last_fit())
    assert kept(stale) == before


def test_an_export_of_one_trial_is_that_trial_of_the_kept_fit(folder):
    assert run("export", folder, "--to", "csv").exit_code == 0
    written = folder / "results/csv/walk.csv"
    of_all = written.read_bytes()
    shutil.rmtree(folder / "results/csv")
    done = run("export", folder, "--to", "csv", "--trial", "walk")
    assert (done.exit_code, done.stderr) == (0, "")
    assert written.read_bytes() == of_all
    assert not (folder / "results/csv/squat.csv").exists()


def test_a_trial_that_came_later_is_not_synthetic(folder):
    shutil.copytree(folder / "trials/walk", folder / "trials/again")
    done = run("export", folder, "--to", "csv", "--trial", "again")
    assert done.exit_code == 1
    assert "no trial 'again' in the kept fit; it has squat, walk" in done.stderr
    assert "again is new" in done.stderr


@pytest.mark.slow
def test_another_fit_is_made_beside_the_kept_one_where_that_is_asked_for(stale):
    before = kept(stale)
    done = run("export", stale, "--to", "csv", "--solve")
    assert done.exit_code == 0, done.output
    assert "and stays; made from another, in" in done.stderr
    assert "without squat (trials/squat/markers.trc: line" in done.stderr
    assert kept(stale) == before
    (made,) = stored_solves(stale / "results")
    assert [trial.name for trial in made.figures.trials] == ["walk"]
    assert not (stale / "results/csv/squat.csv").exists()


def test_a_kept_fit_that_is_current_is_not_made_again_beside_itself(folder):
    assert run("export", folder, "--to", "csv", "--solve").exit_code == 0
    assert stored_solves(folder / "results") == ()


def test_a_kept_fit_that_cannot_be_read_is_told_and_stays(folder):
    (folder / "results/solve-1/skeleton.json").write_text("{")
    before = kept(folder)
    done = run("export", folder, "--to", "csv")
    assert done.exit_code == 1
    assert "skeleton.json: cannot be read" in done.stderr
    assert kept(folder) == before


@pytest.mark.slow
def test_a_fit_of_some_trials_does_not_take_the_place_of_the_whole(folder):
    before = kept(folder)
    done = run("fit", folder, "--trial", "walk")
    assert done.exit_code == 0, done.output
    assert "not kept: the kept fit of" in " ".join(done.stdout.split())
    assert kept(folder) == before


def test_fit_itself_leaves_out_what_cannot_be_read(folder):
    cut(folder)
    done = run("fit", folder)
    assert done.exit_code == 1
    assert "fitted without 1 of 2 trials" in done.stderr
    assert Subject.open(folder).last_fit().trials == ("walk",)
    again = run("export", folder, "--to", "csv")
    assert (again.exit_code, again.stderr.count("without squat (trials/squat/markers.trc: line")) == (0, 1)


@pytest.mark.parametrize(("frames", "is_current"), [((110, 130), True), ((300, 320), False)])
def test_a_flag_that_lets_the_same_forces_count_changes_nothing(folder, frames, is_current):
    subject = Subject.open(folder)
    subject.flag("walk", *frames, author="anna")
    done = run("export", folder, "--to", "csv")
    assert ("out of date (the flags)" not in done.stderr) is is_current
    assert subject.fit().new is not is_current


def test_a_page_shows_what_people_say_now_where_no_force_counts_otherwise(folder):
    subject = Subject.open(folder)
    subject.flag("walk", 110, 130, author="anna", reason="forceDiscrepancy")
    assert run("report", folder).exit_code == 0
    before = kept(folder)
    walk = subject.fit().solved.trials[1]
    assert (110, 130, None, "forceDiscrepancy") in walk.mask.reasons
    assert kept(folder) == before
