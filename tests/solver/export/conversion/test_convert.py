"""Recordings, models and motions from format to format: what comes through, what is told, what is refused."""

from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np
import pyarrow.parquet as pq
import pytest

from solver.capture.capture import FootEvent
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.capture.formats.c3d import read_c3d
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.formats.trc import read_trc
from solver.common.errors import CaptureError
from solver.export.b3d.from_fit import fit_to_b3d
from solver.export.c3d_file import write_c3d
from solver.export.conversion.convert import FOLDER, READERS, WRITERS, convert
from solver.export.conversion.opensim_set import PLATES, read_opensim_set, write_plates
from solver.export.conversion.recordings import read_marker_file
from solver.export.opensim import export_opensim
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.pinocchio_model import RigidBodyModel

PAGE = (Path(__file__).parents[4] / "docs" / "reference" / "export.md").read_text(encoding="utf-8")
FLOAT = 2e-7  # relative, of the four bytes that C3D stores


def measured(path, forces=None):
    """The markers and plates that a file holds."""
    (trial,) = (
        read_marker_file(path, forces) if path.suffix in (".c3d", ".trc") else READERS[path.suffix](path)
    ).trials
    return trial


def assert_same_markers(found, expected, atol=1e-6):
    assert found.names == expected.names
    assert found.rate == pytest.approx(expected.rate)
    np.testing.assert_allclose(found.positions_ground, expected.positions_ground, atol=atol)


def assert_same_plates(found, expected, atol=1e-3):
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        assert one.rate == pytest.approx(other.rate)
        np.testing.assert_allclose(one.force_ground, other.force_ground, atol=atol)
        np.testing.assert_allclose(one.moment_ground, other.moment_ground, atol=atol)
        np.testing.assert_allclose(one.cop_ground, other.cop_ground, atol=1e-5)


def test_c3d_to_c3d_keeps_everything_even_spikes(c3d_file, recording, tmp_path):
    done = convert(c3d_file, tmp_path / "again.c3d")
    assert done.files == (tmp_path / "again.c3d",)
    trial = measured(done.files[0])
    assert_same_markers(trial.markers, recording.markers)
    assert_same_plates(trial.plates, recording.plates)
    for found, expected in zip(trial.plates, recording.plates, strict=True):
        np.testing.assert_allclose(found.corners_ground, expected.corners_ground, atol=1e-6)
    assert [(e.side, e.label) for e in trial.events] == [("Right", "Foot Strike"), ("Left", "Foot Off")]
    np.testing.assert_allclose([e.time_s for e in trial.events], [0.125, 0.5], rtol=FLOAT)
    assert not any("no place" in note or "not converted" in note for note in done.notes)


def test_more_events_than_a_parameter_holds_come_through(recording, tmp_path):
    events = tuple(FootEvent(0.001 * k, "Left", "Foot Off") for k in range(600))
    write_c3d(tmp_path / "long.c3d", replace(recording, events=events))
    convert(tmp_path / "long.c3d", tmp_path / "again.c3d")
    found = measured(tmp_path / "again.c3d").events
    np.testing.assert_allclose([event.time_s for event in found], 0.001 * np.arange(600), atol=1e-6)


def test_c3d_to_trc_and_mot_and_back(c3d_file, recording, tmp_path):
    done = convert(c3d_file, tmp_path / "out" / "walk.trc")
    assert [path.name for path in done.files] == ["walk.trc", "walk_grf.mot"]
    assert_same_markers(read_trc(done.files[0]).markers, recording.markers)
    assert any("no place for gait events, mass and height of walk.c3d" in note for note in done.notes)
    assert any("no place for the corners of plate 1, plate 2" in note for note in done.notes)
    back = convert(done.files[0], tmp_path / "back.c3d", forces=done.files[1])
    trial = measured(back.files[0])
    assert_same_markers(trial.markers, recording.markers)
    assert_same_plates(trial.plates, recording.plates)


def test_a_force_table_alone(c3d_file, recording, tmp_path):
    convert(c3d_file, tmp_path / "forces.mot")
    done = convert(tmp_path / "forces.mot", tmp_path / "forces.parquet")
    assert [path.name for path in done.files] == ["forces_forces.parquet"]
    assert_same_plates(measured(done.files[0]).plates, recording.plates)


def test_parquet_and_back_with_corners(c3d_file, recording, tmp_path):
    done = convert(c3d_file, tmp_path / "walk.parquet")
    assert [path.name for path in done.files] == ["walk.parquet", "walk_forces.parquet"]
    trial = measured(done.files[0])
    assert_same_markers(trial.markers, recording.markers)
    assert_same_plates(trial.plates, recording.plates)
    np.testing.assert_allclose(trial.plates[1].corners_ground, recording.plates[1].corners_ground, atol=1e-6)


def test_b3d_holds_what_was_measured_at_the_markers_frames(c3d_file, recording, tmp_path):
    done = convert(c3d_file, tmp_path / "walk.b3d")
    assert any("at the markers' frames only" in note for note in done.notes)
    header = read_b3d(done.files[0]).header
    assert (header.mass_kg, header.height_m) == (pytest.approx(71.0), pytest.approx(1.75))
    trial = measured(done.files[0])
    assert_same_markers(trial.markers, recording.markers)
    np.testing.assert_allclose(
        trial.plates[0].force_ground[5:-5, 1], recording.plates[0].force_ground[50:-50:10, 1], atol=0.5
    )
    np.testing.assert_allclose(trial.plates[1].corners_ground, recording.plates[1].corners_ground, atol=1e-6)


def test_a_plate_that_may_count_the_other_way_is_told_and_left(recording, tmp_path):
    """Two plates that are never free, under a person who hardly moves, tell nothing of their signs."""
    first, second = recording.plates
    turned = replace(second, force_ground=-second.force_ground, moment_ground=-second.moment_ground)
    write_c3d(tmp_path / "open.c3d", replace(recording, plates=(first, turned)))
    done = convert(tmp_path / "open.c3d", tmp_path / "open.mot")
    assert any("plate 2: which way its force counts is not clear" in note for note in done.notes)
    found = read_storage(tmp_path / "open.mot").column("ground_force_2_vy")
    np.testing.assert_allclose(found, -second.force_ground[:, 1], atol=1e-3)


@pytest.mark.real
def test_forces_on_the_plate_are_turned_to_act_on_the_person(real_data, tmp_path):
    """A laboratory's plate that reads up to 1034 N downwards."""
    source = real_data / "c3d_conformance" / "btk_others" / "shd01.c3d"
    (stored,) = read_c3d(source).plates
    assert stored.force_ground[:, 2].min() < -1000 < 0 > stored.force_ground[:, 2].max()
    done = convert(source, tmp_path / "lab.mot")
    assert any("plate 1: reads the force on the plate; it is turned" in note for note in done.notes)
    found = read_storage(tmp_path / "lab.mot").column("ground_force_1_vy")
    np.testing.assert_allclose(found, -stored.force_ground[:, 2], atol=1e-6)


def test_what_a_c3d_holds_beside_is_named(c3d_file, tmp_path):
    held = ezc3d.c3d(str(c3d_file))
    analog = held["parameters"]["ANALOG"]
    for key, value in (
        ("LABELS", "EMG soleus"),
        ("DESCRIPTIONS", ""),
        ("UNITS", "V"),
        ("SCALE", 1.0),
        ("OFFSET", 0),
    ):
        analog[key]["value"] = [*analog[key]["value"], value]
    held["data"]["analogs"] = np.concatenate(
        [held["data"]["analogs"], held["data"]["analogs"][:, :1]], axis=1
    )
    event = held["parameters"]["EVENT"]
    event["LABELS"]["value"] = ["Foot Strike", "Jump"]
    held.write(str(tmp_path / "emg.c3d"))
    notes = convert(tmp_path / "emg.c3d", tmp_path / "out.trc").notes
    assert any("not converted: 1 events (Jump)" in note for note in notes)
    assert any("no place for analog channels, gait events" in note for note in notes)


def test_analog_channels_come_through_parquet_and_c3d_with_every_sample(real_data, tmp_path):
    source = real_data / "wild" / "unipd_bts" / "2012_10_17" / "Walking1.c3d"
    expected = ezc3d.c3d(str(source))["data"]["analogs"][0, 12:].T  # two plates' channels first
    first = convert(source, tmp_path / "walk.parquet")
    assert tmp_path / "walk_analog.parquet" in first.files
    table = pq.read_table(tmp_path / "walk_analog.parquet")
    assert table.column_names[:2] == ["time_s", "Right Adductor Longus_V"]
    np.testing.assert_array_equal(np.column_stack(table.columns[1:]), expected)
    np.testing.assert_allclose(table["time_s"], np.arange(len(expected)) / 1020, atol=1e-12)
    convert(tmp_path / "walk.parquet", tmp_path / "again.c3d")
    again = ezc3d.c3d(str(tmp_path / "again.c3d"))
    np.testing.assert_allclose(again["data"]["analogs"][0, 12:].T, expected, rtol=FLOAT)
    assert again["parameters"]["ANALOG"]["LABELS"]["value"][12] == "Right Adductor Longus"
    assert again["parameters"]["ANALOG"]["UNITS"]["value"][12] == "V"
    assert not any("analog" in note for note in first.notes)


def test_plates_of_two_clocks_are_two_tables(recording, tmp_path):
    first = recording.plates[0]
    slower = replace(
        first,
        name="slow",
        force_ground=first.force_ground[::2],
        moment_ground=first.moment_ground[::2],
        cop_ground=first.cop_ground[::2],
        rate=500.0,
    )
    write_plates(tmp_path / "one.mot", [first])
    write_plates(tmp_path / "two.mot", [slower])
    one, two = (measured(tmp_path / name) for name in ("one.mot", "two.mot"))
    assert_same_plates(one.plates, [first], atol=1e-6)
    assert_same_plates(two.plates, [slower], atol=1e-6)


@pytest.fixture
def b3d_file(fit, tmp_path):
    write_b3d(fit_to_b3d(fit), tmp_path / "crane.b3d")
    return tmp_path / "crane.b3d"


def test_b3d_to_opensim_and_to_mujoco_and_to_gltf(b3d_file, fit, contacts, tmp_path):
    mujoco = pytest.importorskip("mujoco", reason="the package mujoco is not installed; pip install .[dev]")
    done = convert(b3d_file, tmp_path / "set")
    assert {path.name for path in done.files} >= {
        "model.osim",
        "walk_ik.mot",
        "walk_grf.mot",
        "walk_id.sto",
        "walk.trc",
    }
    skeleton = load_skeleton(tmp_path / "set" / "model.osim")
    (trial,) = read_opensim_set(tmp_path / "set").trials
    motion = fit.trials[0].dynamics.motion
    assert trial.motion.start_time == pytest.approx(0.35)
    np.testing.assert_allclose(
        trial.motion.q, motion.q[:, [motion.dofs.index(n) for n in skeleton.dofs]], atol=1e-9
    )
    order = [motion.dofs.index(name) for name in skeleton.dofs]
    tau = fit.trials[0].dynamics.joint_torques[:, order]
    np.testing.assert_allclose(trial.torques, tau, atol=1e-3)
    np.testing.assert_allclose(trial.contacts.wrench_ground, contacts.wrench_ground, atol=1e-6)
    _, p = RigidBodyModel(fit.skeleton).body_placements(motion.q[[70]])
    for source in (b3d_file, tmp_path / "set"):
        model_file = tmp_path / f"{source.stem}.xml"
        convert(source, model_file)
        model = mujoco.MjModel.from_xml_path(str(model_file))
        data = mujoco.MjData(model)
        with np.load(tmp_path / "walk_motion.npz") as arrays:
            data.qpos[:] = arrays["qpos"][70]
        mujoco.mj_kinematics(model, data)
        for k, name in enumerate(fit.skeleton.body_names):
            x, y, z = p[0, k]
            np.testing.assert_allclose(data.body(name).xpos, [x, -z, y], atol=1e-6)
        (tmp_path / "walk_motion.npz").unlink()
    assert convert(b3d_file, tmp_path / "moving.glb").files == (tmp_path / "moving.glb",)


def test_an_opensim_set_becomes_a_b3d_with_the_pass_that_the_fit_itself_would_have(fit, tmp_path):
    """Motion, forces and model through OpenSim's files; all that follows is what the direct export holds."""
    export_opensim(fit, tmp_path / "set")
    done = convert(tmp_path / "set", tmp_path / "walk.b3d")
    assert any("torques are computed anew" in note for note in done.notes)
    direct, found = fit_to_b3d(fit), read_b3d(tmp_path / "walk.b3d")
    assert found.header.ground_contact_body == ("foot_r",)
    assert found.header.num_dofs == direct.header.num_dofs
    (expected, _), (own,) = direct.trials[0].passes, found.trials[0].passes
    for name in (
        "pos",
        "vel",
        "acc",
        "tau",
        "ground_contact_wrench",
        "com_pos",
        "com_acc",
        "root_frame_residual",
    ):
        one, other = np.array(getattr(own, name)), getattr(expected, name)
        assert np.abs(other).max() > 0.01, name
        np.testing.assert_allclose(one, other, atol=2e-6 * np.abs(other).max(), err_msg=name)
    about = found.trials[0].header.processing_pass_header[0]
    stated = direct.trials[0].header.processing_pass_header[0]
    np.testing.assert_allclose(about.linear_residual, stated.linear_residual, rtol=1e-4, atol=1e-3)


def test_a_motion_and_its_model(fit, tmp_path):
    write_skeleton(fit.skeleton, tmp_path / "crane.osim")
    q = fit.trials[0].motion
    free = [k for k, name in enumerate(q.dofs) if name != "arm_angle"]
    write_storage(tmp_path / "moved.mot", [q.dofs[k] for k in free], q.times, q.q[:, free])
    done = convert(tmp_path / "moved.mot", tmp_path / "moved.glb", model=tmp_path / "crane.osim")
    assert done.files == (tmp_path / "moved.glb",)
    assert any("lacks arm_angle; they stay at the model's values" in note for note in done.notes)
    write_storage(tmp_path / "other.mot", ["a"], q.times, q.q[:, :1])
    with pytest.raises(CaptureError, match="none of the coordinates"):
        convert(tmp_path / "other.mot", tmp_path / "other.glb", model=tmp_path / "crane.osim")


def test_what_a_b3d_holds_beside_is_named(b3d_file, tmp_path):
    notes = convert(b3d_file, tmp_path / "walk.trc").notes
    assert any("no place for model, motion, joint torques, forces on bodies" in note for note in notes)


def test_several_trials_get_a_file_each(b3d_file, tmp_path):
    subject = read_b3d(b3d_file)
    (trial,) = subject.trials
    other = replace(trial, header=replace(trial.header, name="run 2", original_name="run 2"))
    header = replace(subject.header, trial_header=(trial.header, other.header))
    write_b3d(replace(subject, header=header, trials=(trial, other)), tmp_path / "two.b3d")
    done = convert(tmp_path / "two.b3d", tmp_path / "out.trc")
    assert [path.name for path in done.files if path.suffix == ".trc"] == ["out_run_2.trc", "out_walk.trc"]
    one = convert(tmp_path / "two.b3d", tmp_path / "one.trc", trials=["run 2"])
    assert [path.name for path in one.files] == ["one.trc", "one_grf.mot"]
    with pytest.raises(CaptureError, match="no trial 'jump'; trials: walk, run 2"):
        convert(tmp_path / "two.b3d", tmp_path / "no.trc", trials=["jump"])


def test_nothing_is_replaced_unless_asked(c3d_file, tmp_path):
    (tmp_path / "walk_grf.mot").write_text("measured last year")
    with pytest.raises(CaptureError, match=r"walk_grf\.mot would be replaced.*--overwrite"):
        convert(c3d_file, tmp_path / "walk.trc")
    assert (tmp_path / "walk_grf.mot").read_text() == "measured last year"
    assert not (tmp_path / "walk.trc").exists()
    convert(c3d_file, tmp_path / "walk.trc", overwrite=True)
    assert (tmp_path / "walk.trc").is_file()
    before = c3d_file.read_bytes()
    with pytest.raises(CaptureError, match="stays as it is"):
        convert(c3d_file, c3d_file, overwrite=True)
    assert c3d_file.read_bytes() == before


def test_a_failure_leaves_nothing_behind(c3d_file, tmp_path, monkeypatch):
    def fails(content, path):
        path.write_text("half")
        raise CaptureError("disk full")

    monkeypatch.setitem(WRITERS, ".trc", replace(WRITERS[".trc"], write=fails))
    with pytest.raises(CaptureError, match="disk full"):
        convert(c3d_file, tmp_path / "walk.trc")
    assert [path.name for path in tmp_path.iterdir()] == ["walk.c3d"]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("walk.c3d walk.glb", "holds no model, motion. Fit it first"),
        ("walk.c3d walk.foo", r"not written. Choose one of \.c3d"),
        ("nothing.c3d walk.trc", "no file of that name"),
        ("notes.doc walk.trc", "files of that ending are not read"),
        ("notes.txt walk.trc", "forces of that kind cannot be read here. Export one of"),
        ("forces.mot walk.c3d", "holds no markers"),
        ("forces.mot walk.glb", "Name the model of these coordinates with --model"),
        (". walk.trc", "no model with a motion"),
        ("table.parquet walk.trc", "cannot be read as Parquet"),
    ],
)
def test_errors_say_what_to_do(c3d_file, recording, tmp_path, names, said):
    write_plates(tmp_path / "forces.mot", recording.plates)
    for name in ("notes.txt", "notes.doc"):
        (tmp_path / name).write_text("")
    (tmp_path / "table.parquet").write_text("no table")
    source, target = names.split()
    with pytest.raises(CaptureError, match=said):
        convert(tmp_path / source, tmp_path / "out" / target)


def test_forces_and_models_go_where_they_belong(c3d_file, recording, tmp_path):
    write_plates(tmp_path / "forces.mot", recording.plates)
    with pytest.raises(CaptureError, match="belong to a file of markers"):
        convert(tmp_path / "forces.mot", tmp_path / "out.parquet", forces=tmp_path / "forces.mot")
    with pytest.raises(CaptureError, match=r"a model is given to a \.mot or \.sto file"):
        convert(c3d_file, tmp_path / "out.trc", model=tmp_path / "model.osim")


def test_the_page_names_every_ending():
    section = PAGE.split("\n## Converting\n")[1].split("\n## ")[0]
    rows = [
        row.split("|")[1:4]
        for row in section.splitlines()
        if row.startswith("| `") or row.startswith("| a folder")
    ]
    told = {
        ending: (reads.strip(), writes.strip())
        for ending, reads, writes in rows
        for ending in ending.split(",")
    }
    told = {ending.strip(" `"): says for ending, says in told.items()}
    assert {e for e, (reads, _) in told.items() if reads} == {*READERS, "a folder"}
    assert {e for e, (_, writes) in told.items() if writes} == {*WRITERS, "a folder"} - {FOLDER}


@pytest.mark.real
@pytest.mark.parametrize(
    "file",
    [
        "lasem_FAILT01/FAILT01_Walk01.c3d",
        "lasem_FAILT01/FAILT01_SLDJ06.c3d",
        "opensim_core/doubleLegLanding.c3d",
    ],
)
def test_a_laboratorys_file_comes_through(real_data, tmp_path, file):
    """Read by our reader before and after; ezc3d's own reading of the copy's forces agrees as well."""
    source = real_data / "c3d_lab_trials" / file
    convert(source, tmp_path / "copy.c3d")
    before, after = read_c3d(source), read_c3d(tmp_path / "copy.c3d")
    turned = [
        markers.positions_ground @ c3d.up.R_ground_lab.T
        for c3d in (before, after)
        for markers in (c3d.markers,)
    ]
    assert after.markers.names == before.markers.names
    np.testing.assert_allclose(turned[1], turned[0], atol=1e-6)
    assert len(after.plates) == len(before.plates) > 0
    for one, other in zip(before.plates, after.plates, strict=True):
        forces = [p.force_ground @ c3d.up.R_ground_lab.T for p, c3d in ((one, before), (other, after))]
        np.testing.assert_allclose(np.abs(forces[1]), np.abs(forces[0]), atol=2e-3)
        pressed = np.abs(forces[0][:, 1]) > 100
        cops = [p.cop_ground @ c3d.up.R_ground_lab.T for p, c3d in ((one, before), (other, after))]
        np.testing.assert_allclose(cops[1][pressed], cops[0][pressed], atol=1e-5)
    assert [e.label for e in measured(tmp_path / "copy.c3d").events] == [
        e.label for e in measured(source).events
    ]


@pytest.mark.real
def test_a_file_of_the_dataset_becomes_an_opensim_set(real_data, tmp_path):
    """The stored centres of mass, by another program, are those of the model and motion written."""
    source = real_data / "b3d" / "results.b3d"
    convert(source, tmp_path / "set")
    content, b3d = read_opensim_set(tmp_path / "set"), read_b3d(source)
    found = {trial.name: trial for trial in content.trials}
    assert len(found) == len(b3d.trials)
    for trial in b3d.trials:
        motion = found[trial.header.original_name or trial.header.name].motion
        com = RigidBodyModel(content.skeleton).centre_of_mass(motion.q)
        stored = np.array(trial.passes[-1].com_pos)[1:-1]  # the ends were left zero
        np.testing.assert_allclose(com[1:-1], stored, atol=0.002)


def test_no_file_that_was_read_is_replaced(c3d_file, recording, tmp_path):
    forces = tmp_path / "walk_grf.mot"
    write_plates(forces, recording.plates)
    before = forces.read_bytes()
    with pytest.raises(CaptureError, match=r"walk_grf\.mot: is what was to be converted"):
        convert(c3d_file, tmp_path / "walk.trc", forces=forces, overwrite=True)
    assert forces.read_bytes() == before


def test_a_folder_in_the_place_of_a_file_is_told(c3d_file, tmp_path):
    (tmp_path / "out.trc").mkdir()
    with pytest.raises(CaptureError, match=r"out\.trc: is a folder"):
        convert(c3d_file, tmp_path / "out.trc", overwrite=True)
    assert not list((tmp_path / "out.trc").iterdir())


def test_plates_of_a_parquet_with_brackets_in_its_name_come_back(c3d_file, recording, tmp_path):
    convert(c3d_file, tmp_path / "walk[1].parquet")
    assert_same_plates(measured(tmp_path / "walk[1].parquet").plates, recording.plates)


def test_plates_of_an_opensim_set_with_brackets_in_a_name_come_back(fit, recording, tmp_path):
    export_opensim(fit, tmp_path / "set")
    for file in (tmp_path / "set").glob("walk_*"):
        file.rename(file.with_name(file.name.replace("walk", "walk[1]")))
    write_plates(tmp_path / "set" / f"walk[1]{PLATES}.mot", recording.plates)
    (trial,) = read_opensim_set(tmp_path / "set").trials
    assert_same_plates(trial.plates, recording.plates)


def test_an_error_names_the_file_that_was_wanted(recording, tmp_path):
    write_plates(tmp_path / "forces.mot", recording.plates)
    with pytest.raises(CaptureError) as told:
        convert(tmp_path / "forces.mot", tmp_path / "out.b3d")
    assert str(told.value).startswith(f"{tmp_path / 'out.b3d'}: ")
