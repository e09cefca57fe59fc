import dataclasses
from itertools import pairwise

import ezc3d
import numpy as np
import pytest

from solver.capture.axes import vertical_axis_named
from solver.capture.formats.c3d import read_c3d, read_c3d_markers
from solver.capture.formats.recording_files import one_subject
from solver.common.errors import CaptureError

CONFORMANCE = "c3d_conformance"
SPRINT = "sprint_overground_dorn2012_JA1_9ms/JA1Gait35.c3d"
LASEM = "c3d_lab_trials/lasem_FAILT01"


def standing(frames=30):
    """Markers of somebody upright, z up, in mm."""
    rng = np.random.default_rng(1)
    heights = np.array([50.0, 60.0, 500.0, 950.0, 960.0, 1400.0])
    points = rng.normal(0, 60, (1, 6, 3)) + np.array([600.0, 400.0, 0.0])
    points[:, :, 2] = heights
    return np.repeat(points, frames, axis=0) + rng.normal(0, 0.5, (frames, 6, 3))


LABELS = ("RHEE", "RTOE", "RKNE", "RASI", "LASI", "C7")


# Frames, markers, rate and share of unseen marker-frames as their README lists them; axis that is up.
RECORDINGS = {
    "anomalies/UpsideDownData/trial2.c3d": (48, 37, 240, 0.0, "+z"),
    f"{CONFORMANCE}/btk_others/ADemo1_rewrite_c3d_pc_integer.c3d": (512, 24, 200, 0.0069, "+z"),
    f"{CONFORMANCE}/btk_others/shd01.c3d": (237, 27, 250, 0.0, "+z"),
    f"{CONFORMANCE}/c3dorg_sample02/DEC_INT.C3D": (89, 36, 50, 0.0712, "+z"),
    f"{CONFORMANCE}/c3dorg_sample10/TYPE-2.C3D": (199, 13, 60, 0.2524, "+z"),
    f"{CONFORMANCE}/c3dorg_sample15/FP1.C3D": (480, 8, 60, 0.0, "+z"),
    f"{CONFORMANCE}/ezc3d/BTS.c3d": (675, 22, 100, 0.5159, "+y"),
    f"{CONFORMANCE}/ezc3d/FP_Type1.c3d": (634, 22, 100, 0.0, "+y"),
    f"{CONFORMANCE}/ezc3d/FP_Type3.c3d": (2, 34, 250, 0.0, "+z"),
    f"{LASEM}/FAILT01_Walk01.c3d": (783, 46, 100, 0.3977, "+z"),
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d": (499, 33, 200, 0.0, "+z"),
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_markers_of_real_recordings(real_data, name):
    frames, count, rate, unseen, up = RECORDINGS[name]
    c3d = read_c3d(real_data / name)
    assert (c3d.markers.frames, len(c3d.markers.names), c3d.markers.rate) == (frames, count, rate)
    assert np.isnan(c3d.markers.positions_ground[:, :, 0]).mean() == pytest.approx(unseen, abs=1e-4)
    assert c3d.up.name == up
    assert c3d.markers.start_time == 0.0


# Largest vertical force [N] and when more than 20 N are carried [s], as their README lists them.
LOADS = {
    f"{CONFORMANCE}/btk_others/ADemo1_rewrite_c3d_pc_integer.c3d": {1: (656, [[0.95, 1.53]])},
    f"{CONFORMANCE}/c3dorg_sample10/TYPE-2.C3D": {1: (398, [[0.83, 1.51]])},
    f"{CONFORMANCE}/ezc3d/BTS.c3d": {
        1: (662, [[3.52, 4.07]]),
        4: (637, [[3.99, 4.58]]),
        5: (589, [[4.5, 5.08]]),
    },
    f"{LASEM}/FAILT01_SLDJ06.c3d": {2: (1216, [[0.97, 1.65]])},
    f"{LASEM}/FAILT01_Walk01.c3d": {1: (728, [[4.54, 5.16]]), 2: (687, [[4.03, 4.65]])},
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d": {
        1: (2829, [[1.57, 1.93], [2.33, 2.49]]),
        2: (1751, [[1.55, 1.91], [2.35, 2.49]]),
    },
    SPRINT: {
        2: (2446, [[0.35, 0.47]]),
        4: (2191, [[0.58, 0.7]]),
        7: (2360, [[0.82, 0.93]]),
        8: (2162, [[1.04, 1.16]]),
    },
}


def intervals(loaded, rate):
    edges = np.flatnonzero(np.diff(np.r_[0, loaded.astype(int), 0])).reshape(-1, 2)
    return [[start / rate, end / rate] for start, end in edges if (end - start) / rate > 0.04]


@pytest.mark.parametrize("name", LOADS)
def test_loads_of_real_recordings(real_data, name):
    c3d = read_c3d(real_data / name)
    plates = {plate.name: plate for plate in c3d.plates}
    for number, (largest, loaded) in LOADS[name].items():
        plate = plates[f"plate {number}"]
        vertical = plate.force_ground @ c3d.up.up_lab
        assert vertical.max() == pytest.approx(largest, abs=1.0)
        found = intervals(vertical > 20, plate.rate)
        np.testing.assert_allclose(found, loaded, atol=0.011)


@pytest.mark.parametrize("name", LOADS)
def test_loaded_centres_of_pressure_lie_on_the_plate_and_under_the_person(real_data, name):
    c3d = read_c3d(real_data / name)
    for number in LOADS[name]:
        plate = next(p for p in c3d.plates if p.name == f"plate {number}")
        loaded = plate.force_ground @ c3d.up.up_lab > 100
        low, high = plate.corners_ground.min(axis=0), plate.corners_ground.max(axis=0)
        inside = (plate.cop_ground[loaded] > low - 0.03) & (plate.cop_ground[loaded] < high + 0.03)
        assert inside.mean() > 0.97
        frames = (plate.times[loaded] * c3d.markers.rate).astype(int)
        away = c3d.markers.positions_ground[frames] - plate.cop_ground[loaded][:, None]
        assert np.median(np.nanmin(np.linalg.norm(away, axis=2), axis=1)) < 0.15


# Files without ZERO frames to subtract and with usable plates: there ezc3d's own filter must agree.
SAME_AS_EZC3D = (
    f"{CONFORMANCE}/btk_others/ADemo1_rewrite_c3d_pc_integer.c3d",
    f"{CONFORMANCE}/ezc3d/BTS.c3d",
    f"{LASEM}/FAILT01_Walk01.c3d",
    "c3d_lab_trials/opensim_core/aStaticTrial_2.c3d",
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d",
    SPRINT,
)


@pytest.mark.parametrize("name", SAME_AS_EZC3D)
def test_platforms_agree_with_ezc3d(real_data, name):
    c3d = read_c3d(real_data / name)
    platforms = ezc3d.c3d(str(real_data / name), extract_forceplat_data=True)["data"]["platform"]
    assert len(platforms) == len(c3d.plates) > 0
    for plate, other in zip(c3d.plates, platforms, strict=True):
        force = other["force"].T
        centre = plate.corners_ground.mean(axis=0)
        np.testing.assert_allclose(plate.force_ground, force, atol=1e-9)
        np.testing.assert_allclose(
            plate.moment_ground, other["moment"].T / 1000 + np.cross(centre, force), atol=1e-9
        )
        known = np.isfinite(plate.cop_ground).all(axis=1)
        np.testing.assert_allclose(
            plate.cop_ground[known], other["center_of_pressure"].T[known] / 1000, atol=1e-9
        )


def test_kistler_correction_of_the_centre_of_pressure_agrees_with_ezc3d(real_data):
    path = real_data / f"{CONFORMANCE}/ezc3d/FP_Type3.c3d"
    plate = read_c3d(path).plates[0]
    other = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"][0]
    np.testing.assert_allclose(plate.cop_ground, other["center_of_pressure"].T / 1000, atol=1e-9)


def test_one_recording_in_four_encodings_is_one_recording(real_data):
    folder = real_data / f"{CONFORMANCE}/c3dorg_sample02"
    first, *others = (
        read_c3d(folder / name) for name in ("pc_real.c3d", "pc_int.c3d", "Dec_real.c3d", "DEC_INT.C3D")
    )
    for other in others:
        assert other.markers.names == first.markers.names
        # the integer files store steps of 0.2812 mm
        np.testing.assert_allclose(
            other.markers.positions_ground, first.markers.positions_ground, atol=2.82e-4
        )
        for plate, same in zip(other.plates, first.plates, strict=True):
            np.testing.assert_allclose(plate.force_ground, same.force_ground, atol=1e-3)


def test_zero_frames_take_the_offset_off_the_unloaded_plate(real_data):
    c3d = read_c3d(real_data / f"{CONFORMANCE}/c3dorg_sample02/pc_real.c3d")
    raw = ezc3d.c3d(
        str(real_data / f"{CONFORMANCE}/c3dorg_sample02/pc_real.c3d"), extract_forceplat_data=True
    )
    for plate, other in zip(c3d.plates, raw["data"]["platform"], strict=True):
        idle = plate.force_ground[
            -40:, 2
        ]  # long after both steps, and not among the frames of FORCE_PLATFORM:ZERO
        assert np.abs(idle.mean()) < 1.0
        assert np.abs(other["force"][2, -40:].mean()) > 5.0
    assert any("FORCE_PLATFORM:ZERO" in note for note in c3d.notes)


def test_types_2_and_4_of_one_recording_agree(real_data):
    folder = real_data / f"{CONFORMANCE}/c3dorg_sample10"
    two, four = (read_c3d(folder / name).plates[0] for name in ("TYPE-2.C3D", "TYPE-4.C3D"))
    loaded = two.force_ground[:, 2] > 100
    np.testing.assert_allclose(four.force_ground[loaded, 2], two.force_ground[loaded, 2], rtol=0.03)
    # the moment scales of the two files differ by a fifth, hence centimetres
    np.testing.assert_allclose(four.cop_ground[loaded], two.cop_ground[loaded], atol=0.03)


def test_first_stored_frame_is_at_zero_whatever_its_number(real_data):
    c3d = read_c3d(real_data / SPRINT)
    assert c3d.markers.times[0] == 0.0
    assert c3d.plates[0].times[0] == 0.0
    assert c3d.plates[0].rate == 1500.0


@pytest.mark.parametrize(
    ("file", "count"),
    [("treadmill_plates_twice_TD31/fws_end01.c3d", 18), ("child_HC031A/Straight/HC031A06.c3d", 8)],
)
def test_events_stand_on_the_clock_of_the_frames(real_data, file, count):
    """Neither file begins at frame 1. Where a plate crosses 20 N is the judge of the laboratory's events."""
    c3d = read_c3d(real_data / "wild" / file)
    events = c3d.markers.foot_events
    assert len(events) == count
    begins, ends = zip(*(i for plate in c3d.plates for i in crossings(plate)), strict=True)
    for label, found in (("Foot Strike", begins), ("Foot Off", ends)):
        stated = np.array([event.time_s for event in events if event.label == label])
        nearest = np.array([np.abs(stated - time).min() for time in found])
        assert np.median(nearest) < 0.015


def crossings(plate):
    """Seconds between which a plate bears more than 20 N, but for its recording's ends."""
    loaded = np.abs(plate.force_ground[:, 2] - np.median(plate.force_ground[:, 2])) > 20.0
    if loaded.mean() > 0.4:  # a belt, mostly loaded
        loaded = np.abs(plate.force_ground[:, 2]) > 20.0
    edges = np.flatnonzero(np.diff(loaded.astype(int)))
    pairs = [(a, b) for a, b in pairwise(edges) if loaded[a + 1] and b - a > 0.2 * plate.rate]
    return [(plate.times[a + 1], plate.times[b + 1]) for a, b in pairs]


def test_the_same_sprint_as_its_text_files_tell_it(real_data):
    """The .trc of the trial starts at the C3D's frame 1 (0.004 s), turned and shifted: lengths agree."""
    from solver.capture.formats.trc import read_trc

    c3d = read_c3d(real_data / SPRINT).markers
    trc = read_trc(real_data / "sprint_overground_dorn2012_JA1_9ms/run0900cms.trc").markers
    shared = [name for name in trc.names if name in c3d.names]
    assert len(shared) > 40
    for one, two in pairwise(shared):
        apart = [
            m.positions_ground[:, m.names.index(one)] - m.positions_ground[:, m.names.index(two)]
            for m in (c3d, trc)
        ]
        lengths = [np.linalg.norm(a, axis=1) for a in apart]
        assert np.nanmedian(np.abs(lengths[0][1:] - lengths[1])) < 2e-3


def test_analog_samples_that_the_parameters_keep_silent_about(real_data):
    """ezc3d takes them for points and so makes noise of the markers; two on one knee stay together."""
    folder = real_data / f"{CONFORMANCE}/c3dorg_sample28"
    repaired, damaged = read_c3d(folder / "type1.C3D"), read_c3d(folder / "dynamic.C3D")
    markers = repaired.markers
    knee = markers.positions_ground[:, markers.names.index("RKNE1")]
    met = markers.positions_ground[:, markers.names.index("RKNE2")]
    length = np.linalg.norm(knee - met, axis=1)
    assert np.nanstd(length) < 0.01
    assert repaired.up.name == "+y"
    plate = repaired.plates[0]
    assert plate.force_ground[:, 1].max() == pytest.approx(731.25, abs=1.0)  # the plate is not quite level
    np.testing.assert_allclose(damaged.plates[0].force_ground, plate.force_ground)
    assert any("analog" in note for note in repaired.notes)
    assert {"r should", "r should#2"} <= set(damaged.markers.names)


def test_unlabelled_points_and_unit_spellings(real_data):
    sprint = read_c3d(real_data / SPRINT)
    assert not any(name.startswith("*") for name in sprint.markers.names)
    assert any("2 unlabelled" in note for note in sprint.notes)
    peak = read_c3d(real_data / f"{CONFORMANCE}/c3dorg_sample15/FP1.C3D")
    assert np.nanmax(peak.markers.positions_ground) == pytest.approx(2.14, abs=0.01)


def test_subject_prefix_missing_channels_and_a_calibration_applied_twice(real_data):
    c3d = read_c3d(real_data / f"{CONFORMANCE}/btk_others/shd01.c3d")
    assert {"RASI", "C7", "LASI"} <= set(one_subject(c3d.markers).markers.names)
    assert [plate.name for plate in c3d.plates] == ["plate 1"]
    assert any("plate 2" in note and "channels 8" in note for note in c3d.notes)
    assert 500 < np.abs(c3d.plates[0].force_ground[:, 2]).max() < 1500  # a person, not 5.7 times that


def test_garbage_corners_leave_that_plate_out(real_data):
    c3d = read_c3d(real_data / f"{CONFORMANCE}/ezc3d/FP_Type1.c3d")
    assert [plate.name for plate in c3d.plates] == ["plate 1"]
    assert any("plate 2, 3, 4" in note and "CORNERS" in note for note in c3d.notes)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("c3dorg_sample02/sgi_int.c3d", "SGI/MIPS.*Intel"),
        ("c3dorg_sample02/sgi_real.c3d", "SGI/MIPS.*Intel"),
        ("c3dorg_sample18/bad_parameter_section.c3d", "parameter section is damaged at byte"),
        ("btk_others/badParameterOffset.c3d", "damaged"),
        ("btk_others/Empty.c3d", "empty"),
        ("btk_others/Analysis.c3d", "no marker .*LPelvisAngles"),
    ],
)
def test_files_that_cannot_be_read_say_why(real_data, name, message):
    with pytest.raises(CaptureError, match=message) as caught:
        read_c3d(real_data / CONFORMANCE / name)
    assert str(real_data / CONFORMANCE / name) in str(caught.value)


@pytest.mark.parametrize("unit", ["mm", "cm", "m", "mete", "", "furlong"])
def test_units(tmp_path, write_c3d, unit):
    per_metre = {"cm": 100.0, "m": 1.0, "mete": 1.0}.get(unit, 1000.0)
    points = standing() / 1000
    c3d = read_c3d(write_c3d(tmp_path / "a.c3d", points * per_metre, LABELS, units=unit))
    np.testing.assert_allclose(c3d.markers.positions_ground, points, atol=1e-6)
    assert any("mm" in note for note in c3d.notes) == (unit in ("", "furlong"))


def test_points_at_the_origin_and_unseen_ones_are_missing(tmp_path, write_c3d):
    points = standing()
    points[3, 1] = 0.0
    points[5:8, 2] = np.nan
    markers = read_c3d(write_c3d(tmp_path / "a.c3d", points, LABELS)).markers
    missing = np.isnan(markers.positions_ground).all(axis=2)
    assert missing.sum() == 4
    assert missing[3, 1]
    assert missing[5:8, 2].all()


def test_computed_points_are_no_markers(tmp_path, write_c3d):
    labels = ("RHEE", "RKneeAngles", "GlobalAngle", "RASI", "MyOwnQuantity", "C7")
    path = write_c3d(tmp_path / "a.c3d", standing(), labels, POINT__SCALARS=["MyOwnQuantity"])
    c3d = read_c3d(path)
    assert c3d.markers.names == ("RHEE", "RASI", "C7")
    assert any("RKneeAngles" in note and "MyOwnQuantity" in note for note in c3d.notes)


def test_a_path_with_spaces_and_accents(tmp_path, write_c3d):
    folder = tmp_path / "Größe é"
    folder.mkdir()
    path = write_c3d(tmp_path / "a.c3d", standing(), LABELS)
    path = path.rename(folder / "Läufer 1.C3D")
    assert read_c3d(path).markers.names == LABELS


def loaded_plate(plate_of, kind, channels, corners, **described):
    return plate_of(kind, channels, corners * 1000, **described)


def test_forces_on_the_plate_have_the_same_centres_of_pressure(tmp_path, write_c3d, plate_of, flat_corners):
    """Which of the two signs is that of the force on the person is told by the whole recording."""
    wrench = np.tile([10.0, -20.0, -700.0, 14000.0, -7000.0, 300.0], (30, 1))  # z_plate points down
    units = ("N",) * 3 + ("Nmm",) * 3
    reads = []
    for sign in (1, -1):
        plate = loaded_plate(plate_of, 2, sign * wrench, flat_corners, origin=(0, 0, -40), units=units)
        reads.append(read_c3d(write_c3d(tmp_path / f"{sign}.c3d", standing(), LABELS, plates=[plate])))
    person, on_plate = reads
    assert person.plates[0].force_ground[0, 2] == pytest.approx(700)
    np.testing.assert_allclose(on_plate.plates[0].force_ground, -person.plates[0].force_ground)
    np.testing.assert_allclose(on_plate.plates[0].moment_ground, -person.plates[0].moment_ground)
    np.testing.assert_allclose(on_plate.plates[0].cop_ground, person.plates[0].cop_ground)


def test_unknown_platform_types_are_named_and_markers_remain_available(
    tmp_path, write_c3d, plate_of, flat_corners
):
    plate = loaded_plate(plate_of, 5, np.ones((30, 8)), flat_corners)
    path = write_c3d(tmp_path / "a.c3d", standing(), LABELS, plates=[plate])
    with pytest.raises(CaptureError, match=r"plate 1: force platforms of type 5.*subject\.toml"):
        read_c3d(path)
    assert read_c3d_markers(path).markers.names == LABELS


def test_a_person_decides_which_axis_is_up(tmp_path, write_c3d):
    path = write_c3d(tmp_path / "a.c3d", standing(), LABELS)
    assert read_c3d(path).up.name == "+z"
    assert read_c3d(path, vertical_axis_named("-y")).up.name == "-y"


def test_centres_of_pressure_are_unknown_while_the_plate_is_unloaded(
    tmp_path, write_c3d, plate_of, flat_corners
):
    wrench = np.tile([0.0, 0.0, -700.0, 0.0, 0.0, 0.0], (30, 1))
    wrench[20:] = [1.0, 1.0, -4.0, 20.0, 30.0, 5.0]
    plate = loaded_plate(plate_of, 2, wrench, flat_corners, units=("N",) * 3 + ("Nmm",) * 3)
    read = read_c3d(write_c3d(tmp_path / "a.c3d", standing(), LABELS, plates=[plate])).plates[0]
    assert np.isfinite(read.cop_ground[:20]).all()
    assert np.isnan(read.cop_ground[20:]).all()
    np.testing.assert_allclose(read.cop_ground[0], [0.6, 0.4, 0.0], atol=1e-9)


def test_results_are_immutable(tmp_path, write_c3d):
    c3d = read_c3d(write_c3d(tmp_path / "a.c3d", standing(), LABELS))
    with pytest.raises(dataclasses.FrozenInstanceError):
        c3d.notes = ()
