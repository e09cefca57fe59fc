"""C3D files as three readers find them: ezc3d, the Python package c3d, and our own."""

from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from solver.capture.axes import markers_y_up, plate_y_up
from solver.capture.capture import ForcePlate, Markers
from solver.capture.formats.analog_channels import AnalogChannels
from solver.capture.formats.c3d import read_c3d
from solver.export.c3d_file import C3dRecording, FootEvent, ModelOutput, export_c3d, foot_events, write_c3d
from solver.gait.gait_events import Source, Stance, side_of
from solver.gait.trial_gait import Gait

RATE, PER_FRAME, FRAMES = 100.0, 10, 60
CORNERS = np.array([[0.9, 0.02, 0.5], [0.3, 0.02, 0.5], [0.3, 0.02, 0.1], [0.9, 0.02, 0.1]])
LAB = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
FLOAT = 2e-7  # relative, of four bytes


@pytest.fixture
def markers() -> Markers:
    generator = np.random.default_rng(3)
    positions = generator.uniform(-0.4, 0.4, (FRAMES, 6, 3)) + np.linspace(0, 1.8, 6)[:, None] * [0, 1, 0]
    positions[10:20, 2] = np.nan
    return Markers(("RHEE", "LHEE", "Zehe ü", "RASI", "LASI", "HEAD"), positions, RATE)


def plate_at(rate, samples, start_time=0.0, corners=CORNERS) -> ForcePlate:
    """A person of 700 N whose centre of pressure wanders along the plate."""
    t = start_time + np.arange(samples) / rate
    force = np.column_stack([20 * np.sin(9 * t), 700 + 90 * np.cos(7 * t), 15 * np.cos(4 * t)])
    point = np.column_stack([0.5 + 0.2 * t, np.full(samples, 0.02), 0.25 + 0.05 * np.sin(3 * t)])
    free = np.column_stack([0 * t, 4 * np.sin(5 * t), 0 * t])
    return ForcePlate("left one", force, np.cross(point, force) + free, point, rate, start_time, corners)


@pytest.fixture
def recording(markers) -> C3dRecording:
    angles = np.column_stack([np.linspace(-20, 60, FRAMES), np.full(FRAMES, 3.0), np.zeros(FRAMES)])
    return C3dRecording(
        markers=markers,
        plates=(plate_at(RATE * PER_FRAME, FRAMES * PER_FRAME),),
        events=(FootEvent(0.4, "Left", "Foot Off"), FootEvent(0.125, "Right", "Foot Strike")),
        outputs=(
            ModelOutput("hip_r_angles", "ANGLES", "deg", angles, "x hip_flexion_r, y hip_adduction_r"),
            ModelOutput("hip_r_moments", "MOMENTS", "Nmm", 1000 * angles, "x hip_flexion_r"),
        ),
        subject="Zoë",
        mass_kg=71.5,
        height_m=1.82,
    )


def read_back(path):
    found = read_c3d(path)
    plates = tuple(plate_y_up(plate, found.up) for plate in found.plates)
    return markers_y_up(found.markers, found.up), plates


def test_our_reader_finds_what_was_measured(recording, tmp_path):
    assert write_c3d(tmp_path / "walk.c3d", recording) == ()
    markers, (plate,) = read_back(tmp_path / "walk.c3d")
    assert markers.names == recording.markers.names
    assert markers.rate == RATE
    np.testing.assert_allclose(markers.positions_ground, recording.markers.positions_ground, atol=1e-6)
    (written,) = recording.plates
    assert plate.rate == written.rate
    np.testing.assert_allclose(plate.force_ground, written.force_ground, atol=700 * FLOAT)
    np.testing.assert_allclose(plate.moment_ground, written.moment_ground, atol=1000 * FLOAT)
    np.testing.assert_allclose(plate.cop_ground, written.cop_ground, atol=1e-6)
    np.testing.assert_allclose(plate.corners_ground, CORNERS, atol=1e-6)


def test_ezc3d_finds_plates_events_and_outputs(recording, tmp_path):
    write_c3d(tmp_path / "walk.c3d", recording)
    found = ezc3d.c3d(str(tmp_path / "walk.c3d"), extract_forceplat_data=True)
    (platform,) = found["data"]["platform"]
    assert (platform["unit_force"], platform["unit_position"]) == ("N", "mm")
    (written,) = recording.plates
    np.testing.assert_allclose(platform["force"], LAB @ written.force_ground.T, atol=1e-3)
    np.testing.assert_allclose(platform["center_of_pressure"], 1000 * LAB @ written.cop_ground.T, atol=1e-2)
    parameters = found["parameters"]
    assert parameters["EVENT"]["CONTEXTS"]["value"] == ["Right", "Left"]
    assert parameters["EVENT"]["LABELS"]["value"] == ["Foot Strike", "Foot Off"]
    np.testing.assert_allclose(parameters["EVENT"]["TIMES"]["value"], [[0, 0], [0.125, 0.4]], rtol=FLOAT)
    assert found["header"]["points"]["first_frame"] == 0  # ezc3d counts from 0
    point = parameters["POINT"]
    assert (point["ANGLES"]["value"], point["ANGLE_UNITS"]["value"]) == (["hip_r_angles"], ["deg"])
    assert (point["MOMENTS"]["value"], point["MOMENT_UNITS"]["value"]) == (["hip_r_moments"], ["Nmm"])
    column = point["LABELS"]["value"].index("hip_r_angles")
    np.testing.assert_allclose(found["data"]["points"][:3, column].T, recording.outputs[0].values, atol=1e-5)
    assert parameters["PROCESSING"]["BODYMASS"]["value"] == pytest.approx([71.5])
    assert parameters["PROCESSING"]["HEIGHT"]["value"] == pytest.approx([1820.0])
    assert parameters["SUBJECTS"]["NAMES"]["value"] == ["Zoë"]


def test_the_package_c3d_finds_the_same_numbers(recording, tmp_path):
    c3d = pytest.importorskip("c3d", reason="the package c3d is not installed; pip install .[dev]")
    write_c3d(tmp_path / "walk.c3d", recording)
    with (tmp_path / "walk.c3d").open("rb") as file:
        reader = c3d.Reader(file)
        labels = [label.strip() for label in reader.point_labels]
        frames = list(reader.read_frames())
        events = reader.get("EVENT:TIMES").float_array
    assert labels[:2] == ["RHEE", "LHEE"]
    assert (reader.point_rate, reader.analog_rate) == (RATE, RATE * PER_FRAME)
    points = np.array([points for _, points, _ in frames])
    expected = 1000 * recording.markers.positions_ground @ LAB.T
    seen = points[:, :6, 3] >= 0
    np.testing.assert_array_equal(seen, np.isfinite(expected[..., 0]))
    np.testing.assert_allclose(points[:, :6, :3][seen], expected[seen], atol=1e-3)
    signals = np.concatenate([analog for *_, analog in frames], axis=1)
    np.testing.assert_allclose(-signals[2], recording.plates[0].force_ground[:, 1], atol=1e-3)  # z is down
    np.testing.assert_allclose(events, [[0, 0.125], [0, 0.4]], rtol=FLOAT)


@pytest.mark.parametrize("plates", [0, 1])
def test_other_analog_channels_stand_behind_the_plates_sample_by_sample(recording, plates, tmp_path):
    c3d = pytest.importorskip("c3d", reason="the package c3d is not installed; pip install .[dev]")
    values = np.random.default_rng(1).normal(size=(FRAMES * PER_FRAME, 3)).astype(np.float32)
    analog = AnalogChannels(("Fx1", "soleus ü", "y" * 200), ("V", "µV", ""), values, RATE * PER_FRAME)
    notes = write_c3d(
        tmp_path / "walk.c3d", replace(recording, plates=recording.plates[:plates], analog=analog)
    )
    with (tmp_path / "walk.c3d").open("rb") as file:
        reader = c3d.Reader(file)
        frames = list(reader.read_frames())
        units = [reader.get("ANALOG:UNITS").bytes_array[k].decode().strip() for k in range(-3, 0)]
    signals = np.concatenate([samples for *_, samples in frames], axis=1)
    np.testing.assert_array_equal(signals[-3:].T, values)
    assert units == ["V", "µV", ""]
    found = ezc3d.c3d(str(tmp_path / "walk.c3d"))["parameters"]["ANALOG"]["LABELS"]["value"]
    assert found[-3:] == ["Fx1#2" if plates else "Fx1", "soleus ü", "y" * 122]
    assert any("analog channel Fx1 is called Fx1#2" in note for note in notes) == bool(plates)


def test_analog_channels_begin_with_the_first_marker_frame(markers, tmp_path):
    values = np.arange(800.0)[:, None]
    analog = AnalogChannels(("trigger",), ("V",), values, 1000.0)
    notes = write_c3d(tmp_path / "walk.c3d", C3dRecording(replace(markers, start_time=0.25), analog=analog))
    found = ezc3d.c3d(str(tmp_path / "walk.c3d"))["data"]["analogs"][0, 0]
    np.testing.assert_array_equal(found, [*range(250, 800), *[0] * 50])
    assert any("analog channels: not recorded from 0.800 to 0.849 s" in note for note in notes)
    assert any("analog channels: 0.250 s outside the markers' frames are lost" in note for note in notes)


def test_more_channels_than_a_parameter_holds_are_all_there(markers, tmp_path):
    values = np.random.default_rng(2).normal(size=(600, 300)).astype(np.float32)
    analog = AnalogChannels(tuple(f"s{k}" for k in range(300)), ("V",) * 300, values, 1000.0)
    (note,) = write_c3d(tmp_path / "walk.c3d", C3dRecording(markers, analog=analog))
    assert "300 channels: those beyond 255 stand in ANALOG:LABELS2" in note
    found = ezc3d.c3d(str(tmp_path / "walk.c3d"))
    np.testing.assert_array_equal(found["data"]["analogs"][0].T, values)
    assert found["parameters"]["ANALOG"]["LABELS2"]["value"][-1] == "s299"


@pytest.mark.parametrize("rate", [480.0, 1000.0])
def test_a_plate_of_another_clock_is_resampled_and_said(markers, rate, tmp_path):
    plate = plate_at(rate, round(rate * 0.8), start_time=-0.1003)
    notes = write_c3d(tmp_path / "walk.c3d", C3dRecording(markers, (plate,)))
    expected = 500.0 if rate == 480.0 else 1000.0
    assert any(f"resampled from {rate:g} to {expected:g} Hz" in note for note in notes)
    (lost,) = (note for note in notes if "outside the markers' frames are lost" in note)
    assert float(lost.split(" s outside")[0].split()[-1]) == pytest.approx(0.2, abs=0.004)
    _, (found,) = read_back(tmp_path / "walk.c3d")
    truth = plate_at(expected, found.samples)
    inner = slice(20, -20)
    np.testing.assert_allclose(found.force_ground[inner], truth.force_ground[inner], atol=0.05)
    np.testing.assert_allclose(found.moment_ground[inner], truth.moment_ground[inner], atol=0.05)


def test_samples_before_the_first_marker_frame_are_not_shifted_in(markers, tmp_path):
    late = replace(markers, start_time=0.25)
    notes = write_c3d(tmp_path / "walk.c3d", C3dRecording(late, (plate_at(1000.0, 1000),)))
    assert any("frame 1 is at 0.25 s of the recording" in note for note in notes)
    assert not any("resampled" in note for note in notes)
    _, (found,) = read_back(tmp_path / "walk.c3d")
    np.testing.assert_allclose(found.force_ground, plate_at(1000.0, 1000).force_ground[250:850], atol=1e-3)


def test_what_a_plate_did_not_record_is_zero_and_named(markers, recording, tmp_path):
    (plate,) = recording.plates
    force = plate.force_ground.copy()
    force[100:150] = np.nan
    short = replace(
        plate,
        force_ground=force[:500],
        moment_ground=plate.moment_ground[:500],
        cop_ground=plate.cop_ground[:500],
    )
    (note,) = write_c3d(tmp_path / "walk.c3d", C3dRecording(markers, (short,)))
    assert "not recorded from 0.100 to 0.149 s, from 0.500 to 0.599 s; the file has zeros there" in note
    _, (found,) = read_back(tmp_path / "walk.c3d")
    np.testing.assert_array_equal(found.force_ground[[120, 550]], 0.0)
    np.testing.assert_allclose(found.force_ground[200], force[200], atol=1e-3)


def test_a_plate_without_corners_gets_a_rectangle_and_keeps_its_wrench(markers, recording, tmp_path):
    plate = replace(recording.plates[0], corners_ground=None)
    (note,) = write_c3d(tmp_path / "walk.c3d", C3dRecording(markers, (plate,)))
    assert "its corners are not known" in note
    _, (found,) = read_back(tmp_path / "walk.c3d")
    np.testing.assert_allclose(found.force_ground, plate.force_ground, atol=1e-3)
    np.testing.assert_allclose(found.moment_ground, plate.moment_ground, atol=1e-3)
    np.testing.assert_allclose(found.cop_ground, plate.cop_ground, atol=1e-5)
    low, high = found.corners_ground.min(axis=0), found.corners_ground.max(axis=0)
    assert (plate.cop_ground[:, [0, 2]] > low[[0, 2]]).all()
    assert (plate.cop_ground[:, [0, 2]] < high[[0, 2]]).all()


def test_more_labels_than_a_byte_counts(tmp_path):
    positions = np.random.default_rng(1).uniform(0.5, 1.5, (4, 300, 3))
    many = Markers(tuple(f"M{k}" for k in range(300)), positions, 100.0)
    assert write_c3d(tmp_path / "many.c3d", C3dRecording(many)) == ()
    found = read_c3d(tmp_path / "many.c3d").markers
    assert found.names == many.names
    np.testing.assert_allclose(found.positions_ground, positions @ LAB.T, atol=1e-6)


def test_more_events_than_a_byte_counts_and_longer_names(recording, tmp_path):
    """Ezc3d writes both, and then nobody can read the file."""
    names = ("A" * 300, "A" * 299 + "B", "a", "A", "RASI", "HEAD")
    markers = replace(recording.markers, names=names)
    events = tuple(FootEvent(0.001 * k, "Left", "Foot Off") for k in range(600))
    notes = write_c3d(tmp_path / "long.c3d", replace(recording, markers=markers, events=events))
    assert sum("is called" in note for note in notes) == 2
    assert any("600 events: those beyond 255" in note for note in notes)
    found = ezc3d.c3d(str(tmp_path / "long.c3d"))["parameters"]
    labels = found["POINT"]["LABELS"]["value"][:6]
    assert labels[2:] == ["a", "A", "RASI", "HEAD"]
    assert labels[0] != labels[1]
    assert max(map(len, labels)) == 127
    times = [np.array(found["EVENT"][key]["value"])[1] for key in ("TIMES", "TIMES2", "TIMES3")]
    np.testing.assert_allclose(np.concatenate(times), 0.001 * np.arange(600), atol=1e-6)
    c3d = pytest.importorskip("c3d", reason="the package c3d is not installed; pip install .[dev]")
    with (tmp_path / "long.c3d").open("rb") as file:
        assert c3d.Reader(file).get("EVENT:LABELS3").string_array[-1].strip() == "Foot Off"


def test_more_frames_than_the_header_counts_are_there_and_said_by_writer_and_reader(tmp_path):
    c3d = pytest.importorskip("c3d", reason="the package c3d is not installed; pip install .[dev]")
    positions = np.random.default_rng(1).uniform(0.5, 1.5, (70_000, 2, 3))
    (note,) = write_c3d(tmp_path / "long.c3d", C3dRecording(Markers(("A", "B"), positions, 100.0)))
    assert "70000 frames" in note
    with (tmp_path / "long.c3d").open("rb") as file, pytest.warns(UserWarning, match="data"):
        points = [points for _, points, _ in c3d.Reader(file).read_frames(copy=True)]
    np.testing.assert_allclose(np.array(points)[-1, :, :3], 1000 * positions[-1] @ LAB.T, atol=1e-3)
    assert len(points) == 70_000
    assert any("the first 65535 are read" in note for note in read_c3d(tmp_path / "long.c3d").notes)


def points_of(path):
    found = ezc3d.c3d(str(path))
    labels = found["parameters"]["POINT"]["LABELS"]["value"]
    values = found["data"]["points"][:3].transpose(1, 2, 0)
    return dict(zip(labels, values, strict=True)), found["parameters"]


@pytest.fixture
def written(fit, tmp_path):
    (path,), notes = export_c3d(fit, tmp_path / "results" / "c3d")
    assert path == tmp_path / "results" / "c3d" / "walk.c3d"
    assert notes == ("walk.c3d: frame 1 is at 0.35 s of the recording; in a C3D file it is at 0 s",)
    return points_of(path)


def test_angles_are_degrees_joint_by_joint_in_the_order_of_their_axes(written, fit):
    points, parameters = written
    q, dofs = np.degrees(fit.trials[0].dynamics.motion.q), fit.skeleton.dofs
    hip = [q[:, dofs.index(name)] for name in ("hip_flexion", "hip_adduction", "hip_rotation")]
    np.testing.assert_allclose(points["hip_angles"], np.column_stack(hip), atol=1e-4)
    knee = q[:, dofs.index("knee_angle")]
    np.testing.assert_allclose(points["knee_angles"], np.column_stack([knee, 0 * knee, 0 * knee]), atol=1e-4)
    assert parameters["POINT"]["ANGLE_UNITS"]["value"] == ["deg"]
    described = dict(
        zip(parameters["POINT"]["LABELS"]["value"], parameters["POINT"]["DESCRIPTIONS"]["value"], strict=True)
    )
    assert described["hip_angles"] == "x hip_flexion, y hip_adduction, z hip_rotation"


def test_moments_powers_and_the_residual_force_stand_in_their_groups(written, fit):
    points, parameters = written
    dynamics, dofs = fit.trials[0].dynamics, fit.skeleton.dofs
    knee = dofs.index("knee_angle")
    np.testing.assert_allclose(
        points["knee_moments"][:, 0], 1000 * dynamics.joint_torques[:, knee], rtol=1e-5, atol=0.1
    )
    power = dynamics.joint_torques[:, knee] * dynamics.motion.velocity[:, knee]
    np.testing.assert_allclose(points["knee_powers"][:, 0], power, rtol=1e-5, atol=1e-4)
    root = fit.skeleton.joints[0].name
    forces = [dynamics.joint_torques[:, dofs.index(name)] for name in ("tx", "ty", "tz")]
    np.testing.assert_allclose(points[f"{root}_forces"], np.column_stack(forces), rtol=1e-5, atol=1e-3)
    point = parameters["POINT"]
    assert "knee_moments" in point["MOMENTS"]["value"]
    assert point["MOMENT_UNITS"]["value"] == ["Nmm"]
    assert point["POWER_UNITS"]["value"] == ["W"]
    assert f"{root}_forces" in point["FORCES"]["value"]
    assert f"{root}_translations" in point["SCALARS"]["value"]


def test_every_coordinate_is_in_some_point_once(written, fit):
    _, parameters = written
    told = [
        part.split(" ", 1)[1]
        for label, text in zip(
            parameters["POINT"]["LABELS"]["value"], parameters["POINT"]["DESCRIPTIONS"]["value"], strict=True
        )
        if label.endswith(("_angles", "_translations"))
        for part in text.split(", ")
    ]
    assert sorted(told) == sorted(fit.skeleton.dofs)


def test_a_trial_without_dynamics_has_angles_alone(fit, tmp_path):
    trial = replace(fit.trials[0], dynamics=None, contacts=None, mask=None)
    (path,), _ = export_c3d(replace(fit, trials=(trial,)), tmp_path)
    points, parameters = points_of(path)
    assert "hip_angles" in points
    assert not any(label.endswith(("_moments", "_powers", "_forces")) for label in points)
    assert "MOMENTS" not in parameters["POINT"]


def test_markers_that_were_not_seen_stay_unseen(fit, tmp_path):
    positions = np.full((90, 1, 3), 0.5)
    positions[7] = np.nan
    trial = replace(
        fit.trials[0], capture=replace(fit.trials[0].capture, markers=Markers(("M0",), positions, 50.0))
    )
    (path,), _ = export_c3d(replace(fit, trials=(trial,)), tmp_path)
    points, _ = points_of(path)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(points["M0"]).any(axis=1)), [7])
    np.testing.assert_allclose(points["M0"][6], [500, -500, 500])


def test_gait_events_get_the_names_of_the_field():
    stances = (Stance(0, 0.2, 0.9, Source.FORCE), Stance(1, None, 0.4, Source.FEET))
    events = foot_events(Gait(("calcn_r", "calcn_l"), stances, ()))
    assert [(e.time_s, e.side, e.label) for e in events] == [
        (0.2, "Right", "Foot Strike"),
        (0.4, "Left", "Foot Off"),
        (0.9, "Right", "Foot Off"),
    ]


@pytest.mark.parametrize(
    ("body", "side"),
    [
        ("calcn_l", "Left"),
        ("r_foot", "Right"),
        ("LeftFoot", "Left"),
        ("foot", "General"),
        ("calcaneus", "General"),
    ],
)
def test_the_side_of_a_body_is_read_from_its_name(body, side):
    assert side_of(body) == side
