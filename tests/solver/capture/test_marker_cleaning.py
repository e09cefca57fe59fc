import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solver.capture.capture import Markers
from solver.capture.formats.c3d import read_c3d_markers
from solver.capture.formats.trc import read_trc
from solver.capture.marker_cleaning import clean_markers, join_trajectories, unseen_as_nan

NAMES = ("LASI", "RASI", "SACR", "LKNE", "LANK", "LHEE")
PLACES = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0.05, 0.1, 0.08], [0.12, 0.15, 0.02]], dtype=float)


def swinging(rate=100.0, frames=200, count=4):
    """Markers on a leg that swings at running pace."""
    time = np.arange(frames)[:, None] / rate
    phase = np.arange(count)
    x = 0.6 * np.sin(2 * np.pi * 1.5 * time + phase)
    y = 0.3 * np.cos(2 * np.pi * 3.0 * time + phase)
    return Markers(tuple("ABCDEF"[:count]), np.stack([x + 4 * time, y, 0.1 * phase + 0 * x], axis=2), rate)


def changed(markers, place, value):
    positions = markers.positions_ground.copy()
    positions[place] = value
    return Markers(markers.names, positions, markers.rate)


def test_clean_markers_stay_as_they_are():
    markers = swinging()
    cleaned, notes = clean_markers(markers)
    np.testing.assert_array_equal(cleaned.positions_ground, markers.positions_ground)
    assert notes == ()


def test_a_spike_of_one_frame_goes_and_is_named():
    markers = swinging()
    spiked = changed(markers, (50, 1), markers.positions_ground[50, 1] + [0.0, 0.3, 0.2])
    cleaned, notes = clean_markers(spiked)
    assert np.isnan(cleaned.positions_ground[50, 1]).all()
    others = np.ones(markers.positions_ground.shape, bool)
    others[50, 1] = False
    np.testing.assert_array_equal(cleaned.positions_ground[others], markers.positions_ground[others])
    assert len(notes) == 1
    assert "B (frame 50)" in notes[0]


def test_a_short_stay_elsewhere_goes():
    markers = swinging()
    slipped = changed(markers, (slice(80, 85), 2), [3.0, 3.0, 3.0])
    cleaned, notes = clean_markers(slipped)
    missing = np.isnan(cleaned.positions_ground).any(axis=2)
    assert np.flatnonzero(missing[:, 2]).tolist() == [80, 81, 82, 83, 84]
    assert missing.sum() == 5
    assert "jumps there and back" in notes[0]


def test_a_jump_that_lasts_is_told_but_stays():
    markers = swinging()
    jumped = changed(markers, (slice(120, None), 0), markers.positions_ground[120:, 0] + [0.0, 2.0, 0.0])
    cleaned, notes = clean_markers(jumped)
    assert np.isfinite(cleaned.positions_ground).all()
    assert "A (frame 120)" in notes[0]
    assert "left as they are" in notes[0]


def test_a_step_across_a_gap_is_no_teleport():
    markers = swinging()
    gappy = changed(markers, (slice(60, 90), 1), np.nan)
    cleaned, notes = clean_markers(gappy)
    assert notes == ()
    np.testing.assert_array_equal(cleaned.positions_ground, gappy.positions_ground)


def test_a_spike_at_the_rim_of_a_gap_is_left():
    markers = changed(swinging(), (slice(60, 90), 1), np.nan)
    cleaned, _ = clean_markers(changed(markers, (59, 1), markers.positions_ground[59, 1] + 0.2))
    assert np.isfinite(cleaned.positions_ground[59, 1]).all()


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0, 1000.0])
def test_the_fastest_throw_is_no_artefact(rate):
    """A pitcher's hand: 40 m/s within 50 ms of rest, 800 m/s² and the same to stop it."""
    time = np.arange(0, 0.4, 1 / rate)
    speed = np.interp(time, [0.1, 0.15, 0.2], [0.0, 40.0, 0.0])
    x = np.cumsum(speed) / rate
    markers = Markers(("HAND",), np.stack([x, 0 * x, 0 * x + 1], axis=1)[:, None], rate)
    assert clean_markers(markers)[1] == ()


@pytest.mark.parametrize("rate", [30.0, 50.0, 100.0])
def test_a_shaken_hand_is_no_artefact(rate):
    """20 cm to either side nine times a second, 640 m/s²: slow cameras see it turn from frame to frame."""
    time = np.arange(0, 1, 1 / rate)
    y = 0.2 * np.cos(2 * np.pi * 9 * time)
    markers = Markers(("HAND",), np.stack([0 * y, y, 0 * y + 1], axis=1)[:, None], rate)
    assert clean_markers(markers)[1] == ()


@pytest.mark.parametrize("rate", [60.0, 100.0, 250.0])
def test_a_foot_that_strikes_the_ground_is_no_artefact(rate):
    """12 m/s forwards, then 0 from one frame to the next."""
    time = np.arange(0, 0.6, 1 / rate)
    x = 12 * np.minimum(time, 0.3)
    markers = Markers(("HEEL",), np.stack([x, 0 * x, 0 * x + 1], axis=1)[:, None], rate)
    assert clean_markers(markers)[1] == ()


def test_copies_and_empty_markers_are_named():
    markers = swinging()
    positions = markers.positions_ground.copy()
    positions[:, 1] = positions[:, 0]
    positions[30:60, 1] = np.nan
    positions[:, 3] = np.nan
    cleaned, notes = clean_markers(Markers(markers.names, positions, 100.0))
    assert cleaned.names == ("A", "B", "C")
    assert any("never seen: D" in note for note in notes)
    assert any("A and B have the same trajectory" in note for note in notes)
    assert np.isnan(cleaned.positions_ground[30:60, 1]).all()


REAL = (
    "run_treadmill_hamner2013_subject04/run400/markers.trc",
    "sprint_overground_dorn2012_JA1_9ms/run0900cms.trc",
    "sprint_overground_dorn2012_JA1_9ms/JA1Gait35.c3d",
    "opencap_subject4/MarkerData/DJ1.trc",
    "overground_camargo2021_AB06/levelground_ccw_fast_01_01.trc",
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d",
)


@pytest.mark.parametrize("name", REAL)
def test_fast_real_movement_is_not_touched(real_data, name):
    read = read_trc if name.endswith(".trc") else read_c3d_markers
    markers = read(real_data / name).markers
    cleaned, _ = clean_markers(markers)
    seen = np.isfinite(markers.positions_ground).all(axis=2)
    assert np.isfinite(cleaned.positions_ground).all(axis=2).sum() == seen.sum()


@pytest.mark.parametrize("name", REAL)
def test_swaps_put_into_real_movement_are_found(real_data, name):
    """Single frames in which a marker stands where another one of the body is, at least 25 cm away."""
    read = read_trc if name.endswith(".trc") else read_c3d_markers
    markers = read(real_data / name).markers
    rng = np.random.default_rng(9)
    positions = markers.positions_ground.copy()
    placed = []
    for frame in rng.choice(np.arange(5, markers.frames - 5, 6), 12, replace=False):
        one, two = rng.choice(len(markers.names), 2, replace=False)
        around = markers.positions_ground[frame - 1 : frame + 2, one]
        away = np.linalg.norm(markers.positions_ground[frame, two] - around[1])
        if np.isfinite(around).all() and away > 0.25:
            positions[frame, one] = markers.positions_ground[frame, two]
            placed.append((frame, one))
    assert len(placed) > 3
    cleaned, _ = clean_markers(Markers(markers.names, positions, markers.rate))
    kept = [cleaned.names.index(markers.names[one]) for _, one in placed]
    found = [
        np.isnan(cleaned.positions_ground[frame, k]).all() for (frame, _), k in zip(placed, kept, strict=True)
    ]
    assert np.mean(found) == 1.0


def person(frames=20, seed=0):
    """Markers some decimetres apart, moving forward [m]."""
    random = np.random.default_rng(seed)
    placed = random.uniform(-0.5, 0.5, (len(NAMES), 3)) + np.array([0.0, 1.0, 0.0])
    return (
        placed + random.normal(0.0, 1e-3, (frames, len(NAMES), 3)) + np.linspace(0, 1, frames)[:, None, None]
    )


@given(
    st.sets(st.integers(0, 5), min_size=3),
    st.integers(0, 19),
    st.integers(1, 20),
    st.sampled_from([1.0, 1e3]),
)
def test_markers_heaped_into_one_point_count_as_not_seen(group, start, frames, unit):
    positions = person() * unit
    columns = sorted(group)
    heaped = slice(start, min(start + frames, 19))  # one frame at least shows where they are else
    positions[heaped, columns] = positions[heaped, columns[:1]]
    seen, notes = unseen_as_nan(positions, NAMES, "walk.trc")
    expected = np.zeros(positions.shape[:2], dtype=bool)
    expected[heaped, columns] = True
    assert np.array_equal(np.isnan(seen).all(axis=2), expected)
    assert any("in exactly one point" in note for note in notes) == expected.any()


def test_most_of_the_markers_in_one_point_throughout_are_not_seen():
    positions = person()
    positions[:, :4] = positions[:, :1]
    seen, _ = unseen_as_nan(positions, NAMES, "walk.trc")
    assert np.isnan(seen[:, :4]).all()
    assert np.isfinite(seen[:, 4:]).all()


@pytest.mark.parametrize("rounded", [9, 3])
def test_points_computed_onto_a_marker_leave_it_where_it_is(rounded):
    """A foot model's points lie on the heel's marker; rounding makes them equal on some frames."""
    positions = person()
    random = np.random.default_rng(1)
    positions[:, 3:5] = positions[:, 5:] + random.normal(0.0, 2e-4, (20, 2, 3))
    positions = positions.round(rounded)
    positions[7, 3:5] = positions[7, 5]
    seen, notes = unseen_as_nan(positions, NAMES, "walk.c3d")
    assert np.isfinite(seen).all()
    assert not notes


def test_a_marker_with_two_names_is_seen():
    positions = person()
    positions[:, 4] = positions[:, 5]
    assert np.isfinite(unseen_as_nan(positions, NAMES, "walk.c3d")[0]).all()


def test_unseen_markers_are_no_heap():
    positions = person()
    positions[3, :4] = 0.0
    positions[4, :4] = np.nan
    positions[5, 1, 2] = np.nan
    seen, notes = unseen_as_nan(positions, NAMES, "walk.trc")
    assert np.isnan(seen[[3, 4], :4]).all()
    assert np.isnan(seen[5, 1]).all()
    assert [note.split(":")[1].strip() for note in notes] == [
        "0 0 0 counts as not seen",
        "a coordinate is missing, the marker counts as not seen",
    ]


@pytest.fixture
def segment():
    """Five markers on one turning and travelling segment."""
    turn = Rotation.from_euler("yz", np.stack([np.linspace(0, 2, 100), np.linspace(0, 1, 100)], axis=1))
    path = np.linspace([0, 1, 0], [2, 1.2, 0.4], 100)
    x = np.stack([turn.apply(place) + path for place in PLACES], axis=1)
    return x + np.random.default_rng(0).normal(0, 0.0005, x.shape)


def broken(x, names, frames, by=0.0):
    """The last marker's trajectory goes on under another label from some frame on, moved by some metres."""
    piece = np.full((len(x), 1, 3), np.nan)
    piece[frames:, 0] = x[frames:, 4] + by
    first = x.copy()
    first[frames:, 4] = np.nan
    return Markers(names, np.concatenate([first, piece], axis=1), 100.0)


def test_a_piece_under_a_number_continues_the_named_marker(segment):
    markers, notes = join_trajectories(broken(segment, ("A", "B", "C", "D", "RTHI", "*17"), 60))
    assert markers.names == ("A", "B", "C", "D", "RTHI")
    np.testing.assert_array_equal(markers.positions_ground, segment)
    assert notes == ("pieces of one trajectory under several labels, joined: RTHI with *17",)


def test_of_three_pieces_all_are_one(segment):
    markers = broken(segment, ("A", "B", "C", "D", "*1", "*2"), 60)
    third = np.full((100, 1, 3), np.nan)
    third[80:, 0] = markers.positions_ground[80:, 5]
    x = np.concatenate([markers.positions_ground, third], axis=1)
    x[80:, 5] = np.nan
    joined, notes = join_trajectories(Markers((*markers.names, "*3"), x, 100.0))
    assert joined.names == ("A", "B", "C", "D", "*1")
    assert np.isfinite(joined.positions_ground).all()
    assert notes == ("pieces of one trajectory under several labels, joined: *1 with *2, *3",)


def test_another_place_on_the_segment_is_another_marker(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "*17"), 60, by=0.03)
    assert join_trajectories(markers) == (markers, ())


def test_two_names_that_mean_something_are_left_alone(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "RTHX"), 60)
    assert join_trajectories(markers) == (markers, ())


def test_markers_seen_together_are_two(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "*17"), 60)
    markers.positions_ground[60, 4] = segment[60, 4]
    assert join_trajectories(markers) == (markers, ())


def test_pieces_of_one_name_that_never_meet_are_one_marker(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "RTHI#2"), 60, by=0.05)
    joined, notes = join_trajectories(markers)
    assert joined.names == ("A", "B", "C", "D", "RTHI")
    assert np.isfinite(joined.positions_ground).all()
    assert "RTHI with RTHI#2" in notes[0]
    markers.positions_ground[60, 4] = segment[60, 4]
    assert join_trajectories(markers) == (markers, ())
