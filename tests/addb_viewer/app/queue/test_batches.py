"""Many subjects at once: which of the selected trials' subjects are worked on, and what is refused."""

import json

import pytest

from addb_viewer.app.queue.batches import DIAGNOSE, EXPORT, FIT, Batches
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs.root_folder import RootFolder
from solver.common.errors import SolverError
from solver.common.typed_json import plain
from tests.addb_viewer.fit_figures import of_subject, of_trial

NAMES = ("S1", "S2", "S3")


@pytest.fixture
def batches(tmp_path, monkeypatch):
    """Of three subjects, of which S2 has a fit; what is started is noted and not done."""
    for name in NAMES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "walk.trc").write_text("markers")
        (tmp_path / name / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    (tmp_path / "S2" / "results").mkdir()
    (tmp_path / "S2" / "results" / "fit.json").write_text(json.dumps(plain(of_subject(of_trial()))))
    trials = TrialQueue(OpenSubjects(RootFolder(tmp_path, NAMES)))
    made = Batches(trials)
    made.started = []
    for kind, batch in made.by_kind.items():
        monkeypatch.setattr(
            batch, "start", lambda names, by, kind=kind: made.started.append((kind, names, by)) or len(names)
        )
    yield made
    made.close()
    trials.close()


ALL = [(name, "walk") for name in NAMES]


def test_fits_are_for_those_without_and_other_work_for_those_with_a_fit(batches):
    assert batches.start(FIT, [*ALL, ("S9", "walk")], "Zoë") == 2
    assert batches.start(DIAGNOSE, ALL, "Zoë") == 1
    assert batches.start(EXPORT, ALL, "Zoë", "csv") == 1
    assert batches.started == [(FIT, ["S1", "S3"], "Zoë"), (DIAGNOSE, ["S2"], "Zoë"), (EXPORT, ["S2"], "Zoë")]


@pytest.mark.parametrize(
    ("kind", "places", "to", "why"),
    [
        (FIT, [("S2", "walk")], "", "all of them have a fit"),
        (DIAGNOSE, [("S1", "walk")], "", "none of them has a fit yet"),
        (EXPORT, ALL, "--out=/tmp", "no format '--out=/tmp'; formats: opensim, "),
        (FIT, [], "", "all of them have a fit"),
    ],
)
def test_what_makes_no_sense_is_refused(batches, kind, places, to, why):
    with pytest.raises(SolverError, match=why):
        batches.start(kind, places, "Zoë", to)
    assert batches.started == []


def test_rows_show_who_was_assigned_as_far_as_it_went(batches):
    def stops():
        return next(turns)

    turns = iter((True, True, False))
    batches.assign(ALL, " Ben ", "Zoë", stops)
    assert [row.assigned_to for row in sorted(batches._trials.rows(), key=lambda row: row.subject)] == [
        "Ben",
        "Ben",
        "",
    ]


def test_an_export_is_told_to_the_program_as_on_the_command_line(batches, tmp_path):
    batches.start(EXPORT, ALL, "Zoë", "parquet")
    module, *words = batches._export(tmp_path / "S2", tmp_path / "S2" / "results")
    assert module == "addb_viewer"
    assert words == ["export", f"{tmp_path}/S2", "--to", "parquet", "--out", f"{tmp_path}/S2/results"]
