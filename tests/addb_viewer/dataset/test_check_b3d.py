"""Single .b3d files: known faults put into a sound one are told, each by itself; a sound one has none."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.dataset.check import b3d_check
from addb_viewer.dataset.check.b3d_check import b3d_findings
from solver.capture.formats.b3d.b3d_fields import B3dFile
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.capture.formats.b3d.stored import StoredPass
from tests.addb_viewer.told_diagnosis import told


@pytest.fixture(scope="module")
def sound(release):
    return release / "b3d" / "Lab__at_100.b3d"


@pytest.fixture
def spoiled(sound, tmp_path):
    """Writes the file anew with its header, a trial's header, or series of its last pass changed."""

    def write(header=None, trial=None, last=None):
        file = read_b3d(sound)
        (one,) = file.trials
        about = replace(one.header, **(trial or {}))
        passes = (*one.passes[:-1], replace(one.passes[-1], **(last(one.passes[-1]) if last else {})))
        head = replace(file.header, **(header or {}))
        write_b3d(B3dFile(head, (replace(one, header=about, passes=passes),)), tmp_path / "spoiled.b3d")
        return [(one.level.value, one.check, one.said) for one in b3d_findings(tmp_path / "spoiled.b3d")]

    return write


def counting(sound):
    (trial,) = read_b3d(sound).trials
    return np.flatnonzero(np.array(trial.header.missing_GRF_reason) == 0)


def test_a_sound_file_has_no_fault(sound):
    assert b3d_findings(sound) == []


def test_a_file_of_2023_has_the_faults_that_are_known_of_it(real_data):
    found = b3d_findings(real_data / "b3d" / "results.b3d")
    errors = [one.said for one in found if one.level == "error"]
    assert sum("under each other's name" in said for said in errors) == 2
    assert sum("gravity along −z" in said for said in errors) == 2
    assert sum("nobody has reviewed it" in one.said for one in found) == 2


def test_a_mass_that_the_forces_do_not_carry(spoiled, sound):
    mass = read_b3d(sound).header.mass_kg
    found = spoiled(header={"mass_kg": 1.1 * mass})
    assert any(check == "plausible" and f"mass_kg is {1.1 * mass:.1f}" in said for _, check, said in found)


def test_a_residual_that_is_not_what_motion_and_forces_leave(spoiled, sound):
    passes = read_b3d(sound).trials[0].header.processing_pass_header
    wrong = replace(passes[-1], linear_residual=np.array(passes[-1].linear_residual) + 200.0)
    ((level, check, said),) = spoiled(trial={"processing_pass_header": (*passes[:-1], wrong)})
    assert (level, check) == ("error", "forces")
    assert "its motion and forces leave" in said


def test_frames_that_count_and_have_no_force(spoiled, sound):
    rows = counting(sound)

    def unloaded(frames):
        wrench = np.array(frames.ground_contact_wrench)
        wrench[rows[4:12]] = 0.0
        return {"ground_contact_wrench": wrench}

    (said,) = [said for _, check, said in spoiled(last=unloaded) if check == "labels"]
    assert said.startswith("8 frames count and have no force")
    assert said.endswith(f"frame {rows[4]}")


def test_a_centre_of_pressure_that_stands_still_or_is_far_away(spoiled, sound):
    rows = counting(sound)

    def still(frames):
        places = np.array(frames.ground_contact_center_of_pressure)
        return {"ground_contact_center_of_pressure": np.broadcast_to(places[rows[5]], places.shape).copy()}

    def far(frames):
        return {"ground_contact_center_of_pressure": np.array(frames.ground_contact_center_of_pressure) + 5.0}

    assert any("stands still" in said for _, _, said in spoiled(last=still))
    assert any("m from every joint" in said for _, _, said in spoiled(last=far))


def test_a_recording_that_is_there_twice(sound, tmp_path):
    file = read_b3d(sound)
    (one,) = file.trials
    again = replace(one, header=replace(one.header, name="again"))
    write_b3d(B3dFile(file.header, (one, again)), tmp_path / "twice.b3d")
    (found,) = b3d_findings(tmp_path / "twice.b3d")
    assert (found.check, found.said) == ("duplicates", f"is the same recording as {one.header.name}")


def test_numbers_that_are_none_and_a_file_that_is_cut_off(spoiled, sound, tmp_path):
    found = spoiled(last=lambda frames: {"acc": np.full(frames.acc.shape, np.nan)})
    assert ("error", "b3d", "acc of pass 2 has values that are no numbers") in found
    (tmp_path / "cut.b3d").write_bytes(sound.read_bytes()[:5000])
    (one,) = b3d_findings(tmp_path / "cut.b3d")
    assert (one.level, one.check) == ("error", "b3d")


def test_refit_sets_what_the_file_says_beside_what_the_fit_finds(fit_100, sound, monkeypatch):
    (trial,) = fit_100.trials
    frames = trial.motion.frames
    stored = StoredPass("dynamics", np.full(frames, 0.02), np.full(frames, 30.0), np.full(frames, 7.0))
    missing = ~trial.forces_known
    missing[:10] = True  # the file leaves out some more
    capture = replace(trial.capture, stored=(stored,), imported_missing_force=missing)
    fit = replace(fit_100, trials=(replace(trial, capture=capture),))
    monkeypatch.setattr(b3d_check, "solve", lambda *_, **__: fit)
    monkeypatch.setattr(b3d_check, "diagnose", lambda *_, **__: None)
    monkeypatch.setattr(b3d_check, "report", lambda _: told({}))
    (row,), causes = b3d_check.refitted(sound)
    assert (row.stored_pass, causes) == ("dynamics", ())
    assert row.marker_cm[0] == pytest.approx(2.0)
    assert (row.force_N[0], row.moment_Nm[0]) == (pytest.approx(30.0), pytest.approx(7.0))
    assert row.counting == (int((~missing).sum()), int(trial.forces_known.sum()))
    assert row.counting[0] < row.counting[1]
    used = trial.dynamics.used
    rms = np.sqrt(np.mean(np.sum(trial.dynamics.residual_root[used, :3] ** 2, axis=1)))
    assert row.force_N[1] == pytest.approx(rms)
    assert 0 < row.kappa < 1
    head, line, last = b3d_check.in_words([row], causes)
    assert "stored → ours" in head
    assert "30 → " in line
    assert last == "no cause is named"
