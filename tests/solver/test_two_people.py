"""A fit of two people's trials that somebody calls one person's says so, by the names of the trials."""

import shutil
from dataclasses import replace

from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.fitting.summary import all_notes


def test_a_fit_of_two_people_says_so_first(real_data, tmp_path):
    shutil.copyfile(real_data / "opencap_subject4/MarkerData/walking1.trc", tmp_path / "anna.trc")
    shutil.copyfile(real_data / "opencap_subject6/walking1.trc", tmp_path / "bea.trc")
    (tmp_path / "subject.toml").write_text("")
    settings = Settings()
    fit = solve(
        open_subject(tmp_path), replace(settings, trajectory=replace(settings.trajectory, enabled=False))
    )
    said = [note for note in all_notes(fit) if "two people" in note]
    assert len(said) == 1
    assert "these trials seem to be of two people: anna | bea" in said[0]
    assert fit.groundwork.notes[0] == said[0]
