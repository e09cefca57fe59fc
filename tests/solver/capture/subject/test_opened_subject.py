import json
import shutil
from dataclasses import replace

import pytest

from solver.capture.subject.opened_subject import NoSubjectError, open_subject, read_trials, subjects_in
from solver.common.errors import CaptureError
from solver.common.typed_json import plain
from solver.fitting.fit_result import Groundwork
from solver.fitting.summary import summary
from solver.kinematics.marker_matching import MarkerMatch

COLUMNS = [f"ground_{kind}{axis}" for kind in ("force_v", "force_p", "torque_") for axis in "xyz"]
FORCES = "\n".join(
    ["a", "endheader", "\t".join(["time", *COLUMNS]), *(f"{t}" + "\t1" * 9 for t in (0, 0.1, 0.2)), ""]
)
ANGLES = "a\nversion=1\nendheader\ntime\tknee_angle_r\tpelvis_tx\n0\t0\t1\n0.1\t0\t1\n"
WALK, WALK_FORCES = "opencap_subject4/MarkerData/walking1.trc", "opencap_subject4/ForceData/walking1_grf.mot"
JUMP, STATIC = "opencap_subject4/MarkerData/DJ1.trc", "opencap_subject4/MarkerData/static1.trc"


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "Proband 1 é"
    place.mkdir()
    return place


def put(folder, *names, text=""):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def names(subject):
    return [trial.name for trial in subject.trials]


# --- subject.toml


def test_subject_toml(folder):
    put(folder, "m/walk 1.trc", "m/walk 1.mot", "s.trc", "body.osim", "seg/review.json", "jump.c3d")
    (folder / "subject.toml").write_text(
        """
        mass_kg = 75.93
        height_m = "1.80"
        sex = "Male"
        age_years = 30
        model = "body.osim"
        foot_bodies = ["toes_r", "toes_l"]
        static = "s.trc"
        tags = ["healthy"]
        [trials.walk]
        markers = "m/walk 1.trc"
        forces = "m/walk 1.mot"
        review = "seg/review.json"
        [trials."jump 2"]
        markers = "jump.c3d"
        up = "-y"
        moments = "plate"
        """,
        encoding="utf-8",
    )
    subject = open_subject(folder)
    assert subject.name == "Proband 1 é"
    assert (subject.mass_kg, subject.height_m, subject.sex, subject.age_years) == (75.93, 1.8, "male", 30)
    assert subject.foot_bodies == ("toes_r", "toes_l")
    assert subject.model == folder / "body.osim"
    assert subject.static == folder / "s.trc"
    assert subject.tags == ("healthy",)
    walk, jump = subject.trials
    assert (walk.name, walk.markers, walk.forces) == (
        "walk",
        folder / "m/walk 1.trc",
        folder / "m/walk 1.mot",
    )
    assert walk.reviews == (folder / "seg/review.json",)
    assert (jump.name, jump.forces, jump.up, jump.moments) == ("jump 2", None, "-y", "plate")
    assert subject.notes == ()


def test_unknown_keys_are_noted_on_both_levels(folder):
    put(folder, "a.trc")
    put(folder, "subject.toml", text='weight = 70\n[trials.a]\nmarkers = "a.trc"\nforce = "a.mot"\n')
    notes = " ".join(open_subject(folder).notes)
    assert "weight" in notes
    assert "trials.a.force (forces?)" in notes


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[trials.a]\nforces = "a.mot"', "trials.a has no markers"),
        ('[trials.a]\nmarkers = "b.trc"', r"trials\.a\.markers = \"b.trc\": there is no such file"),
        ('[trials.a]\nmarkers = "../../a.trc"', "leads out of the subject's folder"),
        ("[trials.a]\nmarkers = 3", "the name of a file is needed"),
        ('[trials."../a"]\nmarkers = "a.trc"', "leave out / and"),
        ('[trials.".."]\nmarkers = "a.trc"', "leave out / and"),
        ('[trials.a]\nmarkers = "a.trc"\nup = "w"', 'up = "w": choose one of'),
        ('[trials.a]\nmarkers = "a.trc"\nmoments = "lab"', 'moments = "lab": choose one of free'),
        ('[[trials]]\nmarkers = "a.trc"', "tables of their own"),
        ('trials = "a.trc"', "tables of their own"),
        ('[trials]\na = "a.trc"', "trials.a is no table"),
        ('model = "b.osim"\n[trials.a]\nmarkers = "a.trc"', r"model = \"b.osim\": there is no such file"),
        ("mass_kg = 70\nsex male", "line 2"),
    ],
)
def test_a_subject_toml_that_is_wrong(folder, text, message):
    put(folder, "a.trc", "a.mot")
    put(folder, "subject.toml", text=text)
    with pytest.raises(CaptureError, match=message) as caught:
        open_subject(folder)
    assert str(folder / "subject.toml") in str(caught.value)


def test_models_that_subject_toml_does_not_name_are_said_to_be_unused(folder):
    put(folder, "a.trc", "body.osim")
    put(folder, "subject.toml", text='[trials.a]\nmarkers = "a.trc"')
    subject = open_subject(folder)
    assert subject.model is None
    assert any("body.osim" in note for note in subject.notes)


def test_without_trials_in_it_they_are_looked_for(folder):
    put(folder, "a.trc", "b.c3d")
    put(folder, "subject.toml", text="mass_kg = 70")
    assert names(open_subject(folder)) == ["a", "b"]


def test_subject_json_fills_in_what_subject_toml_leaves_out(folder):
    put(folder, "a.trc")
    put(folder, "subject.toml", text='mass_kg = 70\n[trials.a]\nmarkers = "a.trc"')
    put(folder, "_subject.json", text=json.dumps({"massKg": 99, "heightM": "1.8", "sex": "female"}))
    subject = open_subject(folder)
    assert (subject.mass_kg, subject.height_m, subject.sex) == (70, 1.8, "female")


# --- AddBiomechanics


def uploaded(folder, **more):
    values = {
        "massKg": "75.7",
        "heightM": 1.85,
        "sex": "male",
        "footBodyNames": ["calcn_r", "calcn_l"],
        **more,
    }
    put(folder, "_subject.json", text=json.dumps(values))


def test_addbiomechanics_folder(folder):
    uploaded(folder, subjectTags=["healthy"], ageYears=31, email="a@b.c", skeletonPreset="custom")
    put(folder, "unscaled_generic.osim", "trials/walk10/markers.trc", "trials/walk10/grf.mot")
    put(folder, "trials/walk2/markers.c3d", "trials/static/markers.trc", "trials/.DS_Store")
    put(folder, *(f"trials/walk10/segment_{k}/review.json" for k in (1, 2, 10)))
    put(folder, "trials/walk10/segment_3/data.csv", "trials/empty/readme.txt")
    subject = open_subject(folder)
    assert (subject.mass_kg, subject.height_m, subject.sex, subject.age_years) == (75.7, 1.85, "male", 31)
    assert subject.model == folder / "unscaled_generic.osim"
    assert subject.static == folder / "trials/static/markers.trc"
    assert subject.tags == ("healthy",)
    two, ten = subject.trials
    assert (two.name, two.markers.name, two.forces) == ("walk2", "markers.c3d", None)
    assert (ten.name, ten.forces) == ("walk10", folder / "trials/walk10/grf.mot")
    assert [review.parent.name for review in ten.reviews] == ["segment_1", "segment_2", "segment_10"]
    assert any("trials/empty: no markers" in note for note in subject.notes)


def test_trial_ranges_reach_their_trial_and_unknown_keys_are_noted(folder):
    uploaded(folder, trialRanges={"walk": [0.4, 2.0]}, shoeSize=42)
    put(folder, "trials/walk/markers.trc")
    subject = open_subject(folder)
    assert subject.trials[0].ranges == ((0.4, 2.0),)
    assert any("shoeSize" in note for note in subject.notes)
    assert not any("trialRanges" in note for note in subject.notes)


def test_marker_files_in_other_cases(folder):
    uploaded(folder)
    put(folder, "trials/walk/Markers.TRC", "trials/walk/GRF.mot", "trials/walk/._markers.trc")
    (trial,) = open_subject(folder).trials
    assert (trial.markers.name, trial.forces.name) == ("Markers.TRC", "GRF.mot")


# --- loose files


def test_loose_files(folder):
    put(
        folder,
        "walk10.trc",
        "walk2.trc",
        "jump.TRC",
        "sprint.c3d",
        "subject_static.trc",
        "notes.txt",
        "._walk2.trc",
    )
    put(folder, "walk10_grf.mot", "walk2_forces.mot", "jump.mot", text=FORCES)
    subject = open_subject(folder)
    assert names(subject) == ["jump", "sprint", "walk2", "walk10"]
    assert [t.forces and t.forces.name for t in subject.trials] == [
        "jump.mot",
        None,
        "walk2_forces.mot",
        "walk10_grf.mot",
    ]
    assert subject.static == folder / "subject_static.trc"


def test_joint_angles_beside_markers_are_no_forces(folder):
    put(folder, "walk.trc")
    put(folder, "walk.mot", text=ANGLES)
    subject = open_subject(folder)
    assert subject.trials[0].forces is None
    assert any("walk.mot: no forces" in note for note in subject.notes)


@pytest.mark.parametrize(("with_forces", "suffix"), [(True, ".trc"), (False, ".c3d")])
def test_a_trial_that_lies_there_twice(folder, with_forces, suffix):
    put(folder, "walk.trc", "walk.c3d")
    if with_forces:
        put(folder, "walk_grf.mot", text=FORCES)
    subject = open_subject(folder)
    (trial,) = subject.trials
    assert trial.markers.suffix == suffix
    assert any("left out" in note for note in subject.notes)


def test_two_static_trials(folder):
    put(folder, "a.trc", "static1.trc", "Static2.trc")
    subject = open_subject(folder)
    assert subject.static == folder / "static1.trc"
    assert any("Static2.trc" in note for note in subject.notes)


@pytest.mark.parametrize(
    ("models", "chosen"),
    [
        (["unscaled_generic.osim", "a_scaled.osim", "b.osim"], "unscaled_generic.osim"),
        (["b.osim", "a_scaled.osim"], "a_scaled.osim"),
        (["b.osim"], "b.osim"),
        (["Models/unscaled_generic.osim", "Models/match_markers_and_physics.osim"], "unscaled_generic.osim"),
        (["b.osim", "Models/unscaled_generic.osim"], "b.osim"),
        (["Geometry/b.osim"], None),
        ([], None),
    ],
)
def test_choice_of_the_model(folder, models, chosen):
    put(folder, "a.trc", *models)
    model = open_subject(folder).model
    assert (model and model.name) == chosen


@pytest.mark.parametrize("place", ["", "Models/"])
def test_of_several_models_none_is_taken_and_that_is_said(folder, place):
    put(folder, "a.trc", f"{place}a.osim", f"{place}b.osim")
    subject = open_subject(folder)
    assert subject.model is None
    assert any(
        "a.osim, b.osim: several models" in note and f'model = "{place}a.osim"' in note
        for note in subject.notes
    )
    assert [file.file for file in subject.unused] == [f"{place}a.osim", f"{place}b.osim"]


def test_no_folder_no_trials(folder):
    with pytest.raises(CaptureError, match="no folder of that name"):
        open_subject(folder / "none")
    put(folder, "a.txt")
    with pytest.raises(CaptureError, match=r"no folder of that name.*Give its folder"):
        open_subject(folder / "a.txt")
    with pytest.raises(CaptureError, match=r"no trials.*subject\.toml"):
        open_subject(folder)
    put(folder, "below/a.trc")
    with pytest.raises(CaptureError, match="1 marker files lie elsewhere"):
        open_subject(folder)


def test_a_static_trial_and_nothing_else_is_a_trial(folder):
    put(folder, "static.trc")
    subject = open_subject(folder)
    assert (names(subject), subject.static) == (["static"], None)


# --- real recordings


def test_every_described_real_folder_opens(real_data):
    folders = {path.parent for name in ("subject.toml", "_subject.json") for path in real_data.rglob(name)}
    assert len(folders) >= 15
    for folder in folders:
        subject = open_subject(folder)
        assert subject.trials
        assert all(trial.markers.is_file() for trial in subject.trials)
    reviewed = open_subject(real_data / "opencap_reviewed")
    assert (reviewed.mass_kg, reviewed.height_m) == (75.7, 1.85)
    assert [review.parent.name for review in reviewed.trials[0].reviews] == ["segment_1", "segment_2"]


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("subject.toml", '[release]\nsource = "a/b"\n', "release.source"),
        ("subject.toml", "release = 5\n", "release = 5: it is a table"),
        ("subject.toml", "mass_kg = 7 5\n", "subject.toml: "),
        ("subject.toml", '[trials.walk]\nmarkers = "gone.trc"\n', "there is no such file"),
        ("_subject.json", '{"massKg": null, "sex": "f"', "_subject.json: line 1"),
        ("p.b3d", "no such thing", "p.b3d"),
    ],
)
@pytest.mark.parametrize("place", ["P01", "group/P01"])
def test_of_a_folder_whose_only_subject_is_broken_the_reason_is_told(folder, place, name, text, why):
    put(folder, f"{place}/walk.trc") if name != "p.b3d" else None
    put(folder, f"{place}/{name}", text=text)
    with pytest.raises(CaptureError, match="no subject in it can be read") as found:
        subjects_in(folder)
    assert why in str(found.value)
    assert "Put files into" not in str(found.value)


def test_a_folder_of_nobody_says_what_was_sought(folder):
    put(folder, "notes/readme.txt", text="x")
    with pytest.raises(NoSubjectError, match="Nor is any folder in it a subject's"):
        subjects_in(folder)


@pytest.fixture
def broken(real_data, tmp_path):
    """A walk and a jump whose marker file was cut off inside a row by a full disk."""
    shutil.copyfile(real_data / WALK, tmp_path / "walk.trc")
    whole = (real_data / JUMP).read_bytes()
    (tmp_path / "jump.trc").write_bytes(whole[: len(whole) // 2])
    return tmp_path


def test_the_other_trials_are_read_and_the_broken_one_is_told(broken):
    subject = open_subject(broken)
    read = read_trials(subject, subject.trials)
    assert [capture.name for capture in read.captures] == ["walk"]
    (unread,) = read.unread
    assert (unread.name, unread.file.file) == ("jump", "jump.trc")
    assert "cut off" in unread.file.reason
    assert str(broken) not in unread.file.reason
    assert read.notes == (f"jump: left out, jump.trc cannot be used: {unread.file.reason}",)


def test_forces_that_cannot_be_read_are_the_file_that_is_named(broken, real_data):
    whole = (real_data / WALK_FORCES).read_bytes()
    (broken / "walk_grf.mot").write_bytes(whole[: len(whole) // 2])
    shutil.copyfile(real_data / JUMP, broken / "jump.trc")
    subject = open_subject(broken)
    read = read_trials(subject, subject.trials)
    assert [capture.name for capture in read.captures] == ["jump"]
    assert [(trial.name, trial.file.file, trial.file.harm) for trial in read.unread] == [
        ("walk", "walk_grf.mot", 0)
    ]


def test_a_static_trial_that_cannot_be_read_is_left_out_and_told(broken, real_data):
    shutil.copyfile(real_data / JUMP, broken / "jump.trc")
    (broken / "static.trc").write_bytes((real_data / STATIC).read_bytes()[:5000])
    subject = open_subject(broken)
    read = read_trials(subject, subject.trials)
    assert read.static is None
    assert len(read.captures) == 2
    assert "static trial: left out, so the trials alone scale the body; static.trc" in read.notes[0]


def test_with_no_trial_that_can_be_read_it_is_an_error_that_names_the_first(broken):
    (broken / "walk.trc").write_bytes(b"PathFileType\t4\t(X/Y/Z)\twalk.trc\n")
    subject = open_subject(broken)
    with pytest.raises(CaptureError, match=r"jump\.trc: line .*Nor can any of the 1 other trials be read"):
        read_trials(subject, subject.trials)


def test_fit_json_lists_it_first_among_what_is_not_used(broken, small_fit):
    subject = open_subject(broken)
    unread = read_trials(subject, subject.trials).unread
    (broken / "emg.mat").write_text("x")
    groundwork = Groundwork(small_fit.skeleton, MarkerMatch((), (), ()), (), unread=unread)
    again = replace(open_subject(broken), trials=())
    listed = plain(summary(replace(small_fit, subject=again, groundwork=groundwork)))["unused"]
    assert [file["file"] for file in listed] == ["jump.trc", "emg.mat"]
