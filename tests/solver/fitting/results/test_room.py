"""How large a fit will be is known from its recordings, and asked before it is computed."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.jobs.solving import computed, job_for
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import CaptureError
from solver.common.progress import silent
from solver.fitting.pipeline import solve
from solver.fitting.results.disk_space import fit_size
from solver.fitting.results.store import save_fit
from solver.fitting.settings import settings_for

WITHOUT_FORCES = "[trajectory]\nenabled = false\n"


@pytest.mark.parametrize(
    ("name", "obeys_forces"),
    [("walk_gait2354_subject01", True), ("walk_rajagopal2015", False), ("opencap_subject6", False)],
)
def test_a_fit_is_no_larger_than_was_told_and_not_half_as_large(real_data, tmp_path, name, obeys_forces):
    subject = open_subject(real_data / name)
    settings = settings_for(subject.folder)
    settings = replace(settings, trajectory=replace(settings.trajectory, enabled=obeys_forces))
    told = []

    def before_fitting(body, recorded):
        told.append(fit_size(body, recorded, settings))

    fit = solve(subject, settings, before_fitting=before_fitting)
    written = sum(path.stat().st_size for path in save_fit(fit, tmp_path / "results"))
    assert [size / 2 < written <= size for size in told] == [True]


def test_a_solve_that_would_not_fit_on_the_disk_is_refused_before_it_is_computed(
    real_data, small_disk, tmp_path
):
    settings = tmp_path / "settings.toml"
    settings.write_text(WITHOUT_FORCES)
    small_disk.fill(but=300_000)
    subject = real_data / "walk_gait2354_subject01"
    run = CliRunner().invoke(
        app, ["fit", str(subject), "--out", str(small_disk.folder / "results"), "--settings", str(settings)]
    )
    assert run.exit_code == 1
    assert "the disk has 0.3 MB free, and this fit will take about" in run.stderr
    assert "Nothing was computed." in run.stderr
    assert "scaling" not in run.stderr
    assert [path.name for path in small_disk.folder.iterdir()] == ["filler"]


def test_a_solve_again_after_an_edit_asks_as_well(real_data, small_disk, tmp_path):
    settings = tmp_path / "settings.toml"
    settings.write_text(WITHOUT_FORCES)
    subject = real_data / "walk_gait2354_subject01"
    job = job_for(subject, out=small_disk.folder / "results", settings_file=settings)
    kept = solve(job.subject, job.settings, reviews=job.reviews)
    small_disk.fill(but=300_000)
    with pytest.raises(CaptureError, match=r"0\.3 MB free, and this fit will take about"):
        computed(job, kept, silent)
