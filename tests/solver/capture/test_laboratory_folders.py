"""Folders as laboratories leave them, without a subject.toml: right pairs, no wrong one, all else told."""

import shutil
import struct
import unicodedata
from dataclasses import dataclass, field

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.recording_files import read_markers
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.opened_subject import open_subject, subjects_in
from solver.capture.subject.same_motion import markers_of
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError

WALK, WALK_FORCES = "opencap_subject4/MarkerData/walking1.trc", "opencap_subject4/ForceData/walking1_grf.mot"
LIKE_WALK = "opencap_subject4/MarkerData/walkingTO1.trc"  # cut at the same steps of a like walk
LIKE_FORCES = "opencap_subject4/ForceData/walkingTO1_grf.mot"
JUMP, JUMP_FORCES = "opencap_subject4/MarkerData/DJ1.trc", "opencap_subject4/ForceData/DJ1_grf.mot"
SQUATS, SQUAT_FORCES = "opencap_subject4/MarkerData/squats1.trc", "opencap_subject4/ForceData/squats1_grf.mot"
CHAIR_FORCES = "opencap_subject4/ForceData/STS1_grf.mot"
STATIC, MODEL = "opencap_subject4/MarkerData/static1.trc", "opencap_subject4/unscaled_generic.osim"
ANGLES = "opencap_subject4/reference/walking1_ik.mot"
OTHER_WALK, OTHER_FORCES = "opencap_subject6/walking1.trc", "opencap_subject6/walking1_forces.mot"
OTHER_STATIC = "opencap_subject6/static1.trc"
BELT, BELT_FORCES = (
    "walk_gait2354_subject01/subject01_walk1.trc",
    "walk_gait2354_subject01/subject01_walk1_grf.mot",
)
RUN, RUN_FORCES = (
    "run_treadmill_hamner2013_subject04/run400/markers.trc",
    "run_treadmill_hamner2013_subject04/run400/grf.mot",
)
SPRINT, SPRINT_C3D = (f"sprint_overground_dorn2012_JA1_9ms/{n}" for n in ("run0900cms.trc", "JA1Gait35.c3d"))
SPRINT_FORCES = "sprint_overground_dorn2012_JA1_9ms/sprint_grf.mot"
WALKWAY, WALKWAY_FORCES = (
    f"overground_camargo2021_AB06/levelground_ccw_fast_01_01{n}" for n in (".trc", "_grf.mot")
)

TRANSPARENT = "exo_apo_gordon/S1_ET21_exo_transparent/ET21.trc"
NO_EXO_FORCES = "exo_apo_gordon/S1_NE21_no_exo/NE21.mot"


@dataclass(frozen=True)
class Part:
    """A stretch of a recording, on its own clock or on another."""

    source: str
    start: float = -np.inf  # [s]
    end: float = np.inf
    later: float = 0.0  # [s] added to its times


@dataclass(frozen=True)
class Folder:
    """What lies in a folder, by name, and what is right about it."""

    files: dict[str, object]
    pairs: dict[str, str | None]  # forces of each marker file
    left: dict[str, str] = field(default_factory=dict)  # a word of the reason, of files worth checking
    static: str | None = None


NFD = unicodedata.normalize("NFD", "Läufer schnell Kräfte.mot")

FOLDERS = {
    "words before": Folder(
        {"motion_capture_run.trc": RUN, "grf_run.mot": RUN_FORCES}, {"motion_capture_run.trc": "grf_run.mot"}
    ),
    "kinetics": Folder(
        {"WALK01.trc": BELT, "WALK01_kinetics.mot": BELT_FORCES}, {"WALK01.trc": "WALK01_kinetics.mot"}
    ),
    "kine and grf": Folder(
        {"trans_1_kine.trc": WALK, "trans_1_grf.mot": WALK_FORCES}, {"trans_1_kine.trc": "trans_1_grf.mot"}
    ),
    "no common name": Folder(
        {"run0350cms.trc": SPRINT, "jog_grf.mot": SPRINT_FORCES}, {"run0350cms.trc": "jog_grf.mot"}
    ),
    "a word here, a number there": Folder(
        {"A01_PREF_T0015.trc": WALK, "A01_T0015_GRF_2plates.mot": WALK_FORCES},
        {"A01_PREF_T0015.trc": "A01_T0015_GRF_2plates.mot"},
    ),
    "names of two trials, one content, nothing else": Folder(
        {"walk_1.trc": BELT, "walk_2_grf.mot": BELT_FORCES}, {"walk_1.trc": "walk_2_grf.mot"}
    ),
    "names of two trials, one content, and another trial": Folder(
        {"walk_1.trc": BELT, "walk_2_grf.mot": BELT_FORCES, "walk_2.trc": WALK},
        {"walk_1.trc": None, "walk_2.trc": "walk_2_grf.mot"},
    ),
    "feet that stay where they are, of one time, nothing else": Folder(
        {"squats.trc": SQUATS, "session_b.mot": SQUAT_FORCES}, {"squats.trc": "session_b.mot"}
    ),
    "feet that stay where they are, names of two trials": Folder(
        {"squats_1.trc": SQUATS, "squats_2.mot": SQUAT_FORCES}, {"squats_1.trc": None}
    ),
    "the only forces, of another trial": Folder(
        {"steps.trc": TRANSPARENT, "plates.mot": NO_EXO_FORCES},
        {"steps.trc": None},
        {"plates.mot": "cannot be assigned"},
    ),
    "no common name, treadmill": Folder(
        {"jog.trc": RUN, "plates 4 m_s.mot": RUN_FORCES}, {"jog.trc": "plates 4 m_s.mot"}
    ),
    "walk1 and walk10": Folder(
        {
            "Walk1.trc": WALK,
            "Walk10.trc": LIKE_WALK,
            "walk-10 forces.mot": LIKE_FORCES,
            "walk_1-plates.mot": WALK_FORCES,
        },
        {"Walk1.trc": "walk_1-plates.mot", "Walk10.trc": "walk-10 forces.mot"},
    ),
    "forces of another trial, alike": Folder(
        {"walk1.trc": WALK, "walk2_grf.mot": LIKE_FORCES},
        {"walk1.trc": None},
        {"walk2_grf.mot": "cannot be assigned to a trial"},
    ),
    "forces of another trial, alike, names silent": Folder(
        {"gait.trc": WALK, "plates.mot": LIKE_FORCES}, {"gait.trc": None}, {"plates.mot": "against"}
    ),
    "forces of another person": Folder(
        {"run0350cms.trc": OTHER_WALK, "plates.mot": WALK_FORCES},
        {"run0350cms.trc": None},
        {"plates.mot": "against"},
    ),
    "feet that stay where they are": Folder(
        {"squats.trc": SQUATS, "session_b.mot": CHAIR_FORCES},
        {"squats.trc": None},
        {"session_b.mot": "cannot be assigned to a trial"},
    ),
    "one force file for several trials": Folder(
        {
            "session_out.trc": Part(WALKWAY, end=6.0),
            "session_back.trc": Part(WALKWAY, start=8.0),
            "session_forceplates.mot": WALKWAY_FORCES,
        },
        {"session_back.trc": "session_forceplates.mot", "session_out.trc": "session_forceplates.mot"},
    ),
    "one force file that is of one trial only": Folder(
        {"walk.trc": WALK, "drop.trc": JUMP, "plates.mot": JUMP_FORCES},
        {"drop.trc": "plates.mot", "walk.trc": None},
    ),
    "joint angles": Folder(
        {"walk.trc": WALK, "walk.mot": ANGLES, "walk_GRF_filtered.mot": WALK_FORCES},
        {"walk.trc": "walk_GRF_filtered.mot"},
        {"walk.mot": "joint angles"},
    ),
    "upper case": Folder(
        {"GAIT01.TRC": OTHER_WALK, "GAIT01_GRF.MOT": OTHER_FORCES, "GAIT01_STATIC.TRC": OTHER_STATIC},
        {"GAIT01.TRC": "GAIT01_GRF.MOT"},
        static="GAIT01_STATIC.TRC",
    ),
    "umlauts, written in two ways": Folder(
        {"Laeufer_schnell_Marker.trc": RUN, NFD: RUN_FORCES}, {"Laeufer_schnell_Marker.trc": NFD}
    ),
    "a folder per trial": Folder(
        {
            "generic.osim": MODEL,
            "static.trc": STATIC,
            "Gehen/markers.trc": WALK,
            "Gehen/forces.mot": WALK_FORCES,
            "Sprung/markers.trc": JUMP,
            "Sprung/grf.mot": JUMP_FORCES,
        },
        {"Gehen/markers.trc": "Gehen/forces.mot", "Sprung/markers.trc": "Sprung/grf.mot"},
        static="static.trc",
    ),
    "a folder per kind": Folder(
        {
            "Markers/walk 1.trc": WALK,
            "Markers/walk 2.trc": LIKE_WALK,
            "Markers/static.trc": STATIC,
            "Force Plates/walk 1.mot": WALK_FORCES,
            "Force Plates/walk 2.mot": LIKE_FORCES,
        },
        {"Markers/walk 1.trc": "Force Plates/walk 1.mot", "Markers/walk 2.trc": "Force Plates/walk 2.mot"},
        static="Markers/static.trc",
    ),
    "one motion as C3D and as TRC": Folder(
        {"JA1Gait35.c3d": SPRINT_C3D, "run0900cms.trc": SPRINT, "sprint_grf.mot": SPRINT_FORCES},
        {"run0900cms.trc": "sprint_grf.mot"},
        {"JA1Gait35.c3d": "the same motion as run0900cms.trc"},
    ),
    "one motion twice, forces in the C3D": Folder(
        {"JA1Gait35.c3d": SPRINT_C3D, "run0900cms.trc": SPRINT},
        {"JA1Gait35.c3d": None},
        {"run0900cms.trc": "the same motion as JA1Gait35.c3d"},
    ),
    "forces that start late": Folder(
        {"walk_mocap.trc": BELT, "walk_analog.mot": Part(BELT_FORCES, start=0.9)},
        {"walk_mocap.trc": "walk_analog.mot"},
    ),
    "forces of another clock": Folder(
        {"walk_mocap.trc": BELT, "walk_analog.mot": Part(BELT_FORCES, later=100.0)},
        {"walk_mocap.trc": None},
        {"walk_analog.mot": "recorded at other times"},
    ),
    "forces that come half a second late": Folder(
        {"walk_mocap.trc": WALK, "walk_analog.mot": Part(WALK_FORCES, later=0.5)},
        {"walk_mocap.trc": None},
        {"walk_analog.mot": "against"},
    ),
    "raw and filtered": Folder(
        {"walk_kine.trc": WALK, "walk_kinetics_raw.mot": WALK_FORCES, "walk_kinetics_filt.mot": WALK_FORCES},
        {"walk_kine.trc": "walk_kinetics_raw.mot"},
        {"walk_kinetics_filt.mot": "those of walk_kinetics_raw.mot once more"},
    ),
    "keypoints, filtered": Folder(
        {"walk_0-9.trc": WALK, "walk_filt_butterworth_0-9.trc": WALK, "walk_grf.mot": WALK_FORCES},
        {"walk_0-9.trc": "walk_grf.mot"},
        {"walk_filt_butterworth_0-9.trc": "the same motion as walk_0-9.trc"},
    ),
    "keypoints, filtered, with computed markers": Folder(
        {f"walk_0-9{how}.trc": WALK for how in ("", "_filt_butterworth", "_filt_butterworth_LSTM")},
        {"walk_0-9_filt_butterworth_LSTM.trc": None},
        {f"walk_0-9{how}.trc": "_LSTM.trc, which is read" for how in ("", "_filt_butterworth")},
    ),
    "filtered by name, another walk": Folder(
        {"walk.trc": WALK, "walk_filt_butterworth.trc": LIKE_WALK},
        {"walk.trc": None, "walk_filt_butterworth.trc": None},
    ),
    "a folder of processed forces, both kinds in it": Folder(
        {"MarkerData/w1.trc": WALK, "ID/w1_grf.mot": WALK_FORCES, "ID/w1_grf_raw.mot": WALK_FORCES},
        {"MarkerData/w1.trc": "ID/w1_grf_raw.mot"},
        {"ID/w1_grf.mot": "those of ID/w1_grf_raw.mot once more"},
    ),
    "raw and filtered by name, a tenth of a second apart": Folder(
        {
            "walk_kine.trc": WALK,
            "walk_kinetics_raw.mot": WALK_FORCES,
            "walk_kinetics_filt.mot": Part(WALK_FORCES, later=0.1),
        },
        {"walk_kine.trc": "walk_kinetics_raw.mot"},
        {"walk_kinetics_filt.mot": "walk_kine.trc"},
    ),
    "other kinds of files": Folder(
        {
            "walk.trc": WALK,
            "walk_grf.mot": WALK_FORCES,
            "walk.csv": "a,b\n",
            "emg.mat": "x",
            "Protokoll.docx": "x",
        },
        {"walk.trc": "walk_grf.mot"},
        {"walk.csv": "not read here", "emg.mat": "not read here", "Protokoll.docx": "no recording"},
    ),
    "AddBiomechanics' folders, names of the laboratory's own": Folder(
        {
            "trials/walk/run7.trc": WALK,
            "trials/walk/kinetics7.mot": WALK_FORCES,
            "trials/jump/markers.trc": JUMP,
        },
        {"trials/walk/run7.trc": "trials/walk/kinetics7.mot", "trials/jump/markers.trc": None},
    ),
}


@pytest.fixture
def lay_out(real_data, tmp_path):
    """Put files into a folder: a recording of the shared data, a part of one, or a text."""

    def put(files):
        for name, source in files.items():
            path = tmp_path / "Proband" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(source, Part):
                write_part(real_data / source.source, path, source)
            elif (real_data / source).is_file():
                shutil.copyfile(real_data / source, path)
            else:
                path.write_text(source)
        return tmp_path / "Proband"

    return put


def write_part(recording, path, part):
    if path.suffix == ".trc":
        markers = read_trc(recording).markers
        kept = (markers.times >= part.start) & (markers.times <= part.end)
        start = float(markers.times[kept][0]) + part.later
        write_trc(path, Markers(markers.names, markers.positions_ground[kept], markers.rate, start))
    else:
        table = read_storage(recording)
        kept = (table.times >= part.start) & (table.times <= part.end)
        write_storage(path, table.labels, table.times[kept] + part.later, table.values[kept])


@pytest.mark.parametrize("name", FOLDERS)
def test_right_pairs_no_wrong_one_and_every_file_told(lay_out, name):
    wanted = FOLDERS[name]
    folder = lay_out(wanted.files)
    subject = open_subject(folder)

    def named(path):
        return None if path is None else path.relative_to(folder).as_posix()

    assert {named(trial.markers): named(trial.forces) for trial in subject.trials} == wanted.pairs
    assert named(subject.static) == wanted.static
    assert len({trial.name for trial in subject.trials}) == len(subject.trials)
    used = {named(path) for trial in subject.trials for path in (trial.markers, trial.forces)}
    told = {file.file: file.reason for file in subject.unused}
    assert set(told) == set(wanted.files) - used - {wanted.static, named(subject.model)}
    for file, word in wanted.left.items():
        assert word in told[file]
    harms = [file.harm for file in subject.unused]
    assert harms == sorted(harms)


def test_a_clear_name_holds_but_contents_that_contradict_it_are_said_loudly(lay_out):
    folder = lay_out({"walk.trc": WALK, "walk_grf.mot": SQUAT_FORCES})
    (trial,) = open_subject(folder).trials
    assert trial.forces == folder / "walk_grf.mot"
    said = [note for note in read_trial(trial).notes if "do NOT lie under the feet" in note]
    assert len(said) == 1
    assert "walk_grf.mot" in said[0]


def test_a_late_clock_is_told_with_the_moment_that_would_fit(lay_out):
    folder = lay_out({"walk.trc": WALKWAY, "walk_grf.mot": Part(WALKWAY_FORCES, later=1.5)})
    (trial,) = open_subject(folder).trials
    said = " ".join(read_trial(trial).notes)
    assert "do NOT lie under the feet" in said
    earlier = float(said.split("They would fit ")[1].split(" s earlier")[0])
    assert earlier == pytest.approx(1.5, abs=0.16)  # moments are tried every 0.15 s of these 15 s


def test_no_right_pair_is_called_a_contradiction(real_data):
    folders = {path.parent for name in ("subject.toml", "_subject.json") for path in real_data.rglob(name)}
    trials = [
        trial for folder in folders for trial in open_subject(folder).trials if trial.forces is not None
    ]
    assert len(trials) >= 15
    for trial in trials:
        assert not any("NOT lie under" in note for note in read_trial(trial).notes), trial


def test_forces_are_used_wherever_a_recording_has_them_without_any_description(real_data, tmp_path):
    """Every subject of the shared data without its subject.toml pairs what that said."""
    compared = 0
    for described in sorted(real_data.rglob("subject.toml")):
        folder = tmp_path / described.parent.name
        shutil.copytree(described.parent, folder, ignore=shutil.ignore_patterns("subject.toml"))
        wanted = {
            trial.markers.relative_to(described.parent): trial.forces
            and trial.forces.relative_to(described.parent)
            for trial in open_subject(described.parent).trials
        }
        subject = open_subject(folder)
        found = {
            trial.markers.relative_to(folder): trial.forces and trial.forces.relative_to(folder)
            for trial in subject.trials
        }
        same_motion = {file.file for file in subject.unused if file.reason.startswith("the same motion")}
        for markers, forces in wanted.items():
            if markers.as_posix() not in same_motion:
                assert found[markers] == forces, markers
                compared += forces is not None
    assert compared >= 15


def test_two_people_side_by_side_are_two_subjects(lay_out):
    folder = lay_out({"Anna/walk.trc": WALK, "Anna/jump.trc": JUMP, "Bea/walk.trc": OTHER_WALK})
    with pytest.raises(CaptureError, match=r"no trials.*Folders in it: Anna \(a subject of its own.*Bea"):
        open_subject(folder)
    assert [trial.name for trial in open_subject(folder / "Anna").trials] == ["jump", "walk"]


def test_two_people_that_share_a_model_are_two_subjects_since_their_lengths_differ(lay_out):
    folder = lay_out({"generic.osim": MODEL, "S1/walk.trc": WALK, "S2/walk.trc": OTHER_WALK})
    with pytest.raises(CaptureError, match=r"generic\.osim is shared, but body lengths differ"):
        open_subject(folder)


def test_folders_of_one_person_with_the_same_lengths_are_trials_and_a_note_says_so(lay_out):
    folder = lay_out({"generic.osim": MODEL, "day 1/walk.trc": WALK, "day 2/walk.trc": LIKE_WALK})
    subject = open_subject(folder)
    assert [trial.name for trial in subject.trials] == ["walk", "day 2_walk"]
    assert any(
        "day 1, day 2: trials of one person" in note and "generic.osim" in note for note in subject.notes
    )


def test_what_a_link_leads_to_is_never_looked_into_for_a_partner(lay_out, tmp_path, real_data):
    folder = lay_out({"run0350cms.trc": SPRINT})
    outside = tmp_path / "elsewhere.mot"
    shutil.copyfile(real_data / SPRINT_FORCES, outside)
    (folder / "jog_grf.mot").symlink_to(outside)
    subject = open_subject(folder)
    assert [trial.forces for trial in subject.trials] == [None]
    assert [(file.file, "a link that leads out" in file.reason) for file in subject.unused] == [
        ("jog_grf.mot", True)
    ]
    (folder / "run0350cms_grf.mot").symlink_to(outside)  # by its name it is this trial's, wherever it lies
    assert [trial.forces for trial in open_subject(folder).trials] == [folder / "run0350cms_grf.mot"]


def test_results_are_passed_over_and_a_laboratory_s_own_are_told(lay_out):
    folder = lay_out({"walk.trc": WALK, "results/fit.json": "{}", "results/solve-1/walk.trc": WALK})
    assert open_subject(folder).unused == ()
    (folder / "results" / "fit.json").unlink()
    told = open_subject(folder).unused
    assert [file.file for file in told] == ["results/solve-1/"]
    assert [trial.name for trial in open_subject(folder).trials] == ["walk"]


LAB = "c3d_lab_trials/lasem_FAILT01/FAILT01_{}.c3d"


def test_folders_of_one_name_in_their_c3d_files_are_one_person(lay_out):
    folder = lay_out(
        {
            "Static/FAILT01_static02.c3d": LAB.format("static02"),
            "Straight/FAILT01_Walk01.c3d": LAB.format("Walk01"),
            "Jump/FAILT01_SLDJ06.c3d": LAB.format("SLDJ06"),
        }
    )
    subject = open_subject(folder)
    assert subject.static == folder / "Static/FAILT01_static02.c3d"
    assert {trial.name for trial in subject.trials} == {"FAILT01_Walk01", "FAILT01_SLDJ06"}


@pytest.mark.parametrize("session", ["", "session1/"])
def test_the_one_static_trial_in_a_folder_of_its_own_is_that_of_the_folders_beside_it(lay_out, session):
    folder = lay_out(
        {f"{session}cal/X1.trc": STATIC, f"{session}walks/X2.trc": WALK, f"{session}jumps/X3.trc": JUMP}
    )
    subject = open_subject(folder)
    assert subject.static == folder / f"{session}cal/X1.trc"
    assert len(subject.trials) == 2


def test_people_in_folders_with_static_trials_of_their_own_stay_apart(lay_out):
    folder = lay_out(
        {
            "A/static/X1.trc": STATIC,
            "A/walk/X2.trc": WALK,
            "B/static/X1.trc": OTHER_STATIC,
            "B/walk/X2.trc": OTHER_WALK,
        }
    )
    subjects, _ = subjects_in(folder)
    assert [subject.folder.name for subject in subjects] == ["A", "B"]
    assert all(subject.static is not None and len(subject.trials) == 1 for subject in subjects)


def test_a_c3d_and_a_trc_cut_from_it_are_one_trial(lay_out):
    folder = lay_out({"Walk.c3d": LAB.format("Walk01")})
    whole = markers_of(folder / "Walk.c3d")
    (folder / "Walk_L1").mkdir()
    seen = np.flatnonzero(np.isfinite(whole.positions_ground).all(axis=2).mean(axis=1) > 0.9)
    part = whole.positions_ground[seen[len(seen) // 4] : seen[3 * len(seen) // 4]]
    write_trc(folder / "Walk_L1/markers.trc", Markers(whole.names, part, whole.rate, 7.0))
    subject = open_subject(folder)
    assert [trial.markers for trial in subject.trials] == [folder / "Walk.c3d"]
    assert any("the same motion as Walk.c3d" in file.reason for file in subject.unused)


def test_names_that_are_clear_are_not_looked_into(lay_out, monkeypatch):
    folder = lay_out(
        {"walk.trc": WALK, "walk_grf.mot": WALK_FORCES, "static.trc": STATIC, "generic.osim": MODEL}
    )

    def refuse(path, *_arguments, **_more):
        assert path.name == "static.trc", "a recording was read although the names say everything"
        return read_markers(path)  # whether somebody walks in it

    for place in ("force_pairing.read_forces", "force_pairing.read_markers", "same_motion.read_markers"):
        monkeypatch.setattr(f"solver.capture.subject.{place}", refuse)
    (trial,) = open_subject(folder).trials
    assert trial.forces == folder / "walk_grf.mot"


def without_points(c3d: bytes) -> bytes:
    """A C3D file of Intel floats as a program exports its analog channels alone."""
    header = bytearray(c3d[: (c3d[0] - 1) * 512])
    points, analogs = struct.unpack_from("<2H", header, 2)
    first, last = struct.unpack_from("<2H", header, 6)
    data_start = (struct.unpack_from("<H", header, 16)[0] - 1) * 512
    struct.pack_into("<H", header, 2, 0)
    parameters = bytearray(c3d[len(header) : data_start])
    used = parameters.index(b"USED")  # of POINT, the first group
    struct.pack_into("<H", parameters, used + len("USED") + 4, 0)
    frames = np.frombuffer(c3d, "<f4", (last - first + 1) * (4 * points + analogs), data_start)
    channels = frames.reshape(-1, 4 * points + analogs)[:, 4 * points :]
    return bytes(header) + bytes(parameters) + channels.tobytes()


def test_a_c3d_of_analog_channels_alone_is_no_trial_and_told(lay_out, real_data):
    """Also beside markers of its name, which were once left out in favour of it."""
    folder = lay_out({"walk.trc": WALK, "jump.trc": JUMP})
    whole = (real_data / "c3d_lab_trials/lasem_FAILT01/FAILT01_Walk01.c3d").read_bytes()
    for name in ("walk.c3d", "plates.c3d"):
        (folder / name).write_bytes(without_points(whole))
    subject = open_subject(folder)
    assert [trial.markers.name for trial in subject.trials] == ["jump.trc", "walk.trc"]
    told = {file.file: (file.reason, file.harm) for file in subject.unused}
    assert set(told) == {"walk.c3d", "plates.c3d"}
    assert all("analog channels without markers" in reason and harm == 0 for reason, harm in told.values())


def test_a_c3d_and_a_trc_of_one_name_and_motion_are_one_trial(lay_out):
    folder = lay_out({"run.trc": SPRINT, "run.c3d": SPRINT_C3D})
    subject = open_subject(folder)
    assert [trial.markers.name for trial in subject.trials] == ["run.c3d"]
    assert not any("different recordings" in note for note in subject.notes)


def test_a_c3d_and_a_trc_of_one_name_but_two_motions_are_two_trials_and_a_note_says_so(lay_out):
    folder = lay_out({"run.trc": WALK, "run.c3d": SPRINT_C3D})
    subject = open_subject(folder)
    assert {trial.markers.name for trial in subject.trials} == {"run.trc", "run.c3d"}
    (said,) = [note for note in subject.notes if "different recordings" in note]
    assert "run.trc and run.c3d" in said
    assert "do not rise and fall alike" in said


def test_standing_people_of_one_name_are_compared_by_where_their_markers_are(lay_out, real_data):
    """Files of a quiet stance, whose heights hardly change."""
    standing = "c3d_lab_trials/lasem_FAILT01/FAILT01_static02.c3d"
    folder = lay_out({"quiet.trc": STATIC, "quiet.c3d": standing, "still.c3d": standing})
    markers = markers_of(real_data / standing)
    write_trc(folder / "still.trc", markers)
    subject = open_subject(folder)
    assert {trial.markers.name for trial in subject.trials} == {"quiet.trc", "quiet.c3d", "still.c3d"}
    (said,) = [note for note in subject.notes if "different recordings" in note]
    assert "quiet.trc and quiet.c3d" in said
    assert "cm apart" in said


def test_a_broken_c3d_does_not_push_out_the_markers_of_its_name(lay_out, real_data):
    folder = lay_out({"run.trc": SPRINT})
    (folder / "run.c3d").write_bytes((real_data / SPRINT_C3D).read_bytes()[:3000])
    subject = open_subject(folder)
    assert "run.trc" in {trial.markers.name for trial in subject.trials}
    assert any("run.c3d cannot be read" in note for note in subject.notes)
