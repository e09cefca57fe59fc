from dataclasses import replace

import numpy as np
import pytest

from solver.capture.axes import vertical_axis_named
from solver.capture.capture import Markers, TrialFiles
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.common.errors import CaptureError

WALK = "walk_rajagopal2015"
SPRINT = "sprint_overground_dorn2012_JA1_9ms"


@pytest.fixture(scope="module")
def walk(real_data):
    folder = real_data / WALK
    return TrialFiles("walk", folder / "markers.trc", folder / "grf.mot")


def turned(files, folder, markers_up="y", forces_up="y", force_sign=1):
    """The same trial, written as a laboratory with other axes would have exported it."""
    trc = read_trc(files.markers).markers
    R = vertical_axis_named(markers_up).R_ground_lab
    write_trc(folder / "m.trc", replace(trc, positions_ground=trc.positions_ground @ R))
    table = read_storage(files.forces)
    R = vertical_axis_named(forces_up).R_ground_lab
    values = table.values.copy()
    triples = [list(range(k, k + 3)) for k in range(0, values.shape[1], 3)]
    for triple in triples:
        kind = table.labels[triple[0]]
        sign = 1 if kind.endswith("px") else force_sign
        values[:, triple] = sign * values[:, triple] @ R
    write_storage(folder / "f.mot", table.labels, table.times, values)
    return TrialFiles("t", folder / "m.trc", folder / "f.mot")


def same(capture, reference):
    np.testing.assert_allclose(
        capture.markers.positions_ground, reference.markers.positions_ground, atol=1e-6
    )
    for plate, other in zip(capture.plates, reference.plates, strict=True):
        np.testing.assert_allclose(plate.force_ground, other.force_ground, atol=1e-4)
        np.testing.assert_allclose(plate.moment_ground, other.moment_ground, atol=1e-3)
        np.testing.assert_allclose(plate.cop_ground, other.cop_ground, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("up", ["+x", "-x", "-y", "+z", "-z"])
def test_a_laboratory_with_other_axes(walk, tmp_path, up):
    capture = read_trial(turned(walk, tmp_path, up, up))
    same(capture, read_trial(walk))
    assert any(f"{up} points up" in note for note in capture.notes)


def test_markers_z_up_beside_forces_y_up(walk, tmp_path):
    capture = read_trial(turned(walk, tmp_path, "+z", "+y"))
    same(capture, read_trial(walk))
    notes = " ".join(capture.notes)
    assert "m.trc: +z points up" in notes
    assert "f.mot: +y points up" in notes


def test_somebody_who_lies_on_plates_is_not_stood_up(walk, tmp_path):
    """Feet and trunk apart along x, forces along y, everything in one frame: y is up."""
    trc = read_trc(walk.markers).markers
    lying = trc.positions_ground[:, :, [1, 0, 2]] * np.array([1, 0.1, 1]) + np.array([-1.0, 0.1, 0])
    write_trc(tmp_path / "m.trc", Markers(trc.names, lying, trc.rate))
    table = read_storage(walk.forces)
    values = table.values.copy()
    for k, label in enumerate(table.labels):
        if label.endswith("px"):
            values[:, k] = 0.0
    write_storage(tmp_path / "f.mot", table.labels, table.times, values)
    capture = read_trial(TrialFiles("t", tmp_path / "m.trc", tmp_path / "f.mot"))
    np.testing.assert_allclose(capture.markers.positions_ground, lying, atol=1e-6)
    assert any("although" in note for note in capture.notes)


def test_forces_on_the_plate(walk, tmp_path):
    capture = read_trial(turned(walk, tmp_path, force_sign=-1))
    same(capture, read_trial(walk))
    assert any("sign is turned" in note for note in capture.notes)


def test_what_a_person_said_wins(walk):
    capture = read_trial(replace(walk, up="-x", moments="free"))
    down = read_trial(walk).markers.positions_ground
    np.testing.assert_allclose(capture.markers.positions_ground[:, :, 1], -down[:, :, 0])
    assert any("as stated" in note for note in capture.notes)


def test_files_of_different_trials(walk, real_data, tmp_path):
    other = real_data / "run_treadmill_hamner2013_subject04/run400/grf.mot"
    table = read_storage(other)
    values = table.values.copy()
    for k, label in enumerate(table.labels):
        if label.endswith("_px"):
            values[:, k] += 10.0
    write_storage(tmp_path / "far.mot", table.labels, table.times, values)
    assert any(
        "nearest marker" in note for note in read_trial(replace(walk, forces=tmp_path / "far.mot")).notes
    )
    write_storage(tmp_path / "late.mot", table.labels, table.times + 60, table.values)
    assert any(
        "other times" in note for note in read_trial(replace(walk, forces=tmp_path / "late.mot")).notes
    )


def test_sample_numbers_in_place_of_times_are_told(walk, tmp_path):
    head, rows = walk.forces.read_text().split("endheader\n")
    labels, *lines = rows.splitlines()
    numbered = [f"{k}\t{line.split(chr(9), 1)[1]}" for k, line in enumerate(lines)]
    (tmp_path / "f.mot").write_text(head + "endheader\n" + "\n".join([labels, *numbered]) + "\n")
    notes = read_trial(replace(walk, forces=tmp_path / "f.mot")).notes
    assert sum("sampled at 1 Hz, more slowly than the markers (100 Hz)" in note for note in notes) == 2
    assert not any("more slowly" in note for note in read_trial(walk).notes)


def with_forces(walk, path, change):
    table = read_storage(walk.forces)
    values = table.values.copy()
    change(values, table)
    write_storage(path, table.labels, table.times, values)
    return read_trial(replace(walk, forces=path))


def test_a_row_of_absurd_numbers_is_unmeasured_and_changes_nothing_else(walk, tmp_path):
    def absurd(values, table):
        values[1000] = 1e30

    plain, changed = read_trial(walk), with_forces(walk, tmp_path / "f.mot", absurd)
    second = read_storage(walk.forces).times[1000]
    new = [note for note in changed.notes if "above 20000 N" in note]
    assert len(new) == len(changed.plates) == 2
    assert all(f"first at {second:.3f} s" in note for note in new)
    assert len(changed.notes) == len(plain.notes) + 2
    for plate, other in zip(changed.plates, plain.plates, strict=True):
        assert np.flatnonzero(np.isnan(plate.force_ground).all(axis=1)).tolist() == [1000]
        others = np.arange(plate.samples) != 1000
        np.testing.assert_allclose(plate.force_ground[others], other.force_ground[others], atol=1e-6)
        np.testing.assert_allclose(plate.moment_ground[others], other.moment_ground[others], atol=1e-6)


def test_a_plate_that_was_not_recorded_is_named(walk, tmp_path):
    def blank(values, table):
        values[:, [k for k, label in enumerate(table.labels) if "_l_" in label]] = np.nan

    notes = with_forces(walk, tmp_path / "f.mot", blank).notes
    (told,) = [note for note in notes if "not recorded" in note]
    assert "ground_force_l" in told


def test_plates_that_nobody_stepped_on_are_told_together(walk, tmp_path):
    def unloaded(values, table):
        values[:] = 0

    notes = with_forces(walk, tmp_path / "f.mot", unloaded).notes
    assert sum("no plate carries a load at any time" in note for note in notes) == 1
    assert not any("carries a load" in note for note in read_trial(walk).notes)


@pytest.mark.real
@pytest.mark.parametrize(
    ("file", "stands"),
    [
        ("dead_plates_athlete_s001/walking_1.c3d", True),
        ("patient_bone_deformity_p01/session1/static01/c3dfile.c3d", False),
    ],
)
def test_plates_that_were_not_recorded_under_feet_are_told(real_data, file, stands):
    """The other child stands beside the plates."""
    if not (real_data / "wild" / file).is_file():
        pytest.skip(f"no {file}")
    notes = read_trial(TrialFiles("t", real_data / "wild" / file)).notes
    (told,) = [note for note in notes if "no plate carries a load at any time" in note]
    assert ("the plates were not recorded" in told) == stands


def test_the_named_force_file_wins_over_the_c3d_s_own(real_data):
    folder = real_data / SPRINT
    inside = read_trial(TrialFiles("a", folder / "JA1Gait35.c3d"))
    named = read_trial(TrialFiles("a", folder / "JA1Gait35.c3d", folder / "sprint_grf.mot"))
    assert len(inside.plates) == 8
    assert [plate.name for plate in named.plates] != [plate.name for plate in inside.plates]
    assert len(named.plates) == 2
    assert any("not used" in note and "sprint_grf.mot" in note for note in named.notes)
    np.testing.assert_array_equal(named.markers.positions_ground, inside.markers.positions_ground)
    again = read_trial(TrialFiles("a", folder / "JA1Gait35.c3d", folder / "JA1Gait35.c3d"))
    assert len(again.plates) == 8


def test_c3d_and_text_of_one_sprint_agree_about_forces(real_data):
    """The .mot was made of the C3D by others, filtered and a few ms late: the impulse [N·s] is the same."""
    folder = real_data / SPRINT
    c3d = read_trial(TrialFiles("a", folder / "JA1Gait35.c3d"))
    mot = read_trial(TrialFiles("a", folder / "run0900cms.trc", folder / "sprint_grf.mot"))
    ours, theirs = (
        sum(plate.force_ground[:, 1].sum() / plate.rate for plate in capture.plates) for capture in (c3d, mot)
    )
    assert ours == pytest.approx(theirs, rel=0.01)


def test_review_of_the_drop_jump(real_data):
    """77 frames up to t = 0.76 s are labelled missing; the second segment starts at 1.09 s and none is."""
    subject = open_subject(real_data / "opencap_reviewed")
    capture = read_trial(subject.trials[0])
    missing = capture.imported_missing_force
    assert len(missing) == capture.markers.frames
    assert np.flatnonzero(missing).tolist() == list(range(77))


def test_review_of_the_walk(real_data):
    capture = read_trial(open_subject(real_data / WALK).trials[0])
    assert np.flatnonzero(~capture.imported_missing_force).tolist() == list(range(61, 175))


def test_static_trials(real_data):
    static = read_static(real_data / "c3d_lab_trials/lasem_FAILT01/FAILT01_static02.c3d")
    assert (static.markers.frames, len(static.markers.names)) == (300, 50)
    heights = dict(
        zip(static.markers.names, np.nanmedian(static.markers.positions_ground[:, :, 1], axis=0), strict=True)
    )
    assert heights["C7"] > heights["SACR"] > heights["LPAT"] > heights["LHEEL"] > 0
    assert static.plates == ()


@pytest.mark.parametrize("suffix", [".csv", ".mot", ""])
def test_markers_of_unknown_kind(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_text("a,b\n")
    with pytest.raises(CaptureError, match=r"cannot be read here. Export one of \.trc, \.c3d"):
        read_trial(TrialFiles("t", tmp_path / f"a{suffix}"))


def test_forces_of_unknown_kind(walk, tmp_path):
    with pytest.raises(CaptureError, match=r"Export one of \.mot, \.sto, \.c3d"):
        read_trial(replace(walk, forces=tmp_path / "a.xlsx"))


def test_every_trial_of_every_described_folder(real_data):
    """Each opens, stands upright over its plates, and says which axis was up."""
    folders = {path.parent for name in ("subject.toml", "_subject.json") for path in real_data.rglob(name)}
    for folder in sorted(folders):
        subject = open_subject(folder)
        for files in subject.trials:
            capture = read_trial(files)
            positions = capture.markers.positions_ground
            assert any("points up" in note for note in capture.notes), files
            heights = positions[np.isfinite(positions).all(axis=2).any(axis=1), :, 1]
            assert 0.0 < np.median(np.nanmax(heights, axis=1)) < 2.3, files
            assert np.nanmin(positions[:, :, 1]) > -0.2, files
            for plate in capture.plates:
                loaded = np.abs(plate.force_ground[:, 1]) > 50
                assert not loaded.any() or np.median(plate.force_ground[loaded, 1]) > 0, files
                assert np.isfinite(plate.cop_ground[loaded]).all(), files
        if subject.static:
            assert read_static(subject.static).markers.names
