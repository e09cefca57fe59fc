"""Each change of a plate, a clock or a marker against the catalogue's sentence, said in other words."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, freqz
from scipy.spatial.transform import Rotation

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.simulate.faults import recorded
from solver.skeleton.forward import body_poses


@pytest.fixture(params=["zeroed", "noisy"])
def plate(request, recording, noisy_recording):
    return (recording if request.param == "zeroed" else noisy_recording).trials[0].plates[0]


def moment_about(plate, point):
    return plate.moment_ground - np.cross(point, plate.force_ground)


def levers(plate):
    """Horizontal moment about the centre of pressure over the load: none, if it is a centre of pressure."""
    on = recorded.loaded(plate)
    about = plate.moment_ground[on] - np.cross(plate.cop_ground[on], plate.force_ground[on])
    return np.hypot(about[:, 0], about[:, 2]) / plate.force_ground[on, 1]


def test_a_gain_multiplies_the_wrench_and_leaves_the_centre_of_pressure(plate):
    wrong = recorded.change_gain(plate, 0.04)
    np.testing.assert_allclose(wrong.force_ground, 1.04 * plate.force_ground)
    np.testing.assert_allclose(wrong.moment_ground, 1.04 * plate.moment_ground)
    np.testing.assert_array_equal(wrong.cop_ground, plate.cop_ground)


def test_a_bias_has_no_moment_about_the_plates_centre(plate):
    bias = np.array([3.0, -12.0, 7.0])
    wrong = recorded.add_bias(plate, bias, while_unloaded=False)
    on = recorded.loaded(plate)
    np.testing.assert_allclose((wrong.force_ground - plate.force_ground)[on], np.tile(bias, (on.sum(), 1)))
    middle = (plate.cop_ground[on].min(axis=0) + plate.cop_ground[on].max(axis=0)) / 2
    np.testing.assert_allclose(moment_about(wrong, middle), moment_about(plate, middle), atol=1e-9)
    assert np.nanmax(levers(wrong)) < 1e-9


def test_a_downward_bias_draws_the_centre_of_pressure_away_from_the_centre(plate):
    wrong = recorded.add_bias(plate, np.array([0.0, -12.0, 0.0]), while_unloaded=False)
    on = recorded.loaded(plate, 200.0)
    before = np.linalg.norm(plate.cop_ground[on] - recorded.centre(plate), axis=1)
    after = np.linalg.norm(wrong.cop_ground[on] - recorded.centre(plate), axis=1)
    load = plate.force_ground[on, 1]
    np.testing.assert_allclose(after, before * load / (load - 12.0), rtol=1e-3)


def test_a_bias_may_or_may_not_be_written_while_nobody_stands_there(recording):
    plate = recording.trials[0].plates[0]
    off = recorded.silent(plate)
    assert off.sum() > 100
    bias = np.array([5.0, 6.0, 7.0])
    np.testing.assert_allclose(
        recorded.add_bias(plate, bias, True).force_ground[off], np.tile(bias, (off.sum(), 1))
    )
    assert not recorded.add_bias(plate, bias, False).force_ground[off].any()


def test_a_plate_in_the_wrong_place_moves_its_centre_of_pressure_alone(plate):
    shift = np.array([0.010, 0.0, -0.006])
    wrong = recorded.shift_plate(plate, shift)
    on = np.isfinite(plate.cop_ground).all(axis=1)
    np.testing.assert_allclose((wrong.cop_ground - plate.cop_ground)[on], np.tile(shift, (on.sum(), 1)))
    np.testing.assert_array_equal(wrong.force_ground, plate.force_ground)
    np.testing.assert_allclose(
        wrong.moment_ground[on, 1] - np.cross(wrong.cop_ground, wrong.force_ground)[on, 1],
        plate.moment_ground[on, 1] - np.cross(plate.cop_ground, plate.force_ground)[on, 1],
        atol=1e-9,
    )


def test_a_yaw_turns_x_towards_minus_z(plate):
    """Right hand about +y: a quarter turn takes +x to -z and +z to +x."""
    wrong = recorded.turn_plate(plate, 90.0)
    on = recorded.loaded(plate)
    np.testing.assert_allclose(wrong.force_ground[on, 0], plate.force_ground[on, 2], atol=1e-9)
    np.testing.assert_allclose(wrong.force_ground[on, 2], -plate.force_ground[on, 0], atol=1e-9)
    np.testing.assert_allclose(wrong.force_ground[on, 1], plate.force_ground[on, 1])
    middle = recorded.centre(plate)
    np.testing.assert_allclose(
        (wrong.cop_ground - middle)[on, 2], -(plate.cop_ground - middle)[on, 0], atol=1e-9
    )


def test_a_tilt_about_z_by_a_degree_leans_the_weight_backwards(plate):
    """R(rotation vector +z) takes +y towards -x."""
    wrong = recorded.tilt_plate(plate, 0.0, 1.0)
    on = recorded.loaded(plate)
    expected = (
        np.cos(np.radians(1)) * plate.force_ground[on, 0] - np.sin(np.radians(1)) * plate.force_ground[on, 1]
    )
    np.testing.assert_allclose(wrong.force_ground[on, 0], expected, atol=1e-9)
    np.testing.assert_array_equal(wrong.cop_ground, plate.cop_ground)
    about_x = recorded.tilt_plate(plate, 1.0, 0.0).force_ground[on, 2]
    expected = (
        np.cos(np.radians(1)) * plate.force_ground[on, 2] + np.sin(np.radians(1)) * plate.force_ground[on, 1]
    )
    np.testing.assert_allclose(about_x, expected, atol=1e-9)


def test_exchanged_plates_keep_their_centres_of_pressure(recording):
    one, other = recording.trials[0].plates
    a, b = recorded.exchange_readings(one, other)
    np.testing.assert_array_equal(a.force_ground, other.force_ground)
    np.testing.assert_array_equal(b.force_ground, one.force_ground)
    np.testing.assert_array_equal(a.cop_ground, one.cop_ground)
    np.testing.assert_array_equal(b.cop_ground, other.cop_ground)
    np.testing.assert_allclose(recorded.free_moment(a), recorded.free_moment(other), atol=1e-9)


@pytest.mark.parametrize(
    ("axes", "matrix"),
    [("x", np.diag([-1.0, 1, 1])), ("z", np.diag([1.0, 1, -1])), ("xz", np.eye(3)[[2, 1, 0]])],
)
def test_axes_read_wrongly_change_the_force_alone(plate, axes, matrix):
    wrong = recorded.misread_axes(plate, axes)
    np.testing.assert_allclose(wrong.force_ground, plate.force_ground @ matrix.T)
    np.testing.assert_array_equal(wrong.cop_ground, plate.cop_ground)
    np.testing.assert_allclose(recorded.free_moment(wrong), recorded.free_moment(plate), atol=1e-9)


def test_a_blanked_stance_leaves_the_others(plate):
    stance = recorded.stances(plate)[0]
    wrong = recorded.blank_samples(plate, stance)
    assert not wrong.force_ground[stance].any()
    assert np.isnan(wrong.cop_ground[stance]).all()
    rest = np.ones(plate.samples, dtype=bool)
    rest[stance] = False
    np.testing.assert_array_equal(wrong.force_ground[rest], plate.force_ground[rest])


def test_a_stance_is_whole(plate):
    for stance in recorded.stances(plate):
        assert recorded.loaded(plate)[stance].all()
        assert not recorded.loaded(plate)[[stance.start - 1, stance.stop]].any()


RATE = 1000.0


def time_history(times):
    """A force that is smooth and known at any time."""
    return 600 + 300 * np.sin(2 * np.pi * 1.1 * times) + 50 * np.sin(2 * np.pi * 5.3 * times + 1)


@pytest.fixture
def capture():
    times = np.arange(2001) / RATE
    force = np.stack([0.1 * time_history(times), time_history(times), -0.05 * time_history(times)], axis=1)
    cop = np.tile([0.3, 0.0, 0.2], (len(times), 1)) + 0.05 * np.sin(times)[:, None] * np.array([1.0, 0, 1])
    plate = ForcePlate("ground_force_1", force, np.cross(cop, force), cop, RATE)
    markers = Markers(("A",), np.arange(201)[:, None, None] * np.ones((1, 1, 3)) / 100, 100.0)
    return Capture("t", markers, (plate,))


@pytest.mark.parametrize("offset", [0.008, -0.008, 0.0123, -0.0217])
def test_late_forces_show_at_a_time_what_was_true_before(capture, offset):
    late = recorded.delay(capture, offset)
    first_frame = late.markers.positions_ground[0, 0, 0]  # the marker tells the true time
    times = first_frame + np.arange(late.plates[0].samples) / RATE
    np.testing.assert_allclose(late.plates[0].force_ground[:, 1], time_history(times - offset), atol=1e-6)
    assert late.plates[0].samples == (late.markers.frames - 1) * 10 + 1
    lost = (201 - late.markers.frames) / 100
    assert abs(offset) <= lost < abs(offset) + 0.0101


@pytest.mark.parametrize("stretch", [0.01, -0.01])
def test_a_stretched_clock_starts_right_and_runs_away(capture, stretch):
    wrong = recorded.stretch_time(capture, stretch)
    times = np.arange(wrong.plates[0].samples) / RATE
    np.testing.assert_allclose(
        wrong.plates[0].force_ground[:, 1], time_history(times / (1 + stretch)), atol=1e-6
    )
    assert wrong.markers.positions_ground[0, 0, 0] == 0


def test_zeros_stay_zeros_between_the_samples(capture):
    plate = recorded.blank_samples(capture.plates[0], slice(500, 900))
    wrong = recorded.delay(replace(capture, plates=(plate,)), 0.0123).plates[0]
    assert recorded.silent(wrong).sum() == pytest.approx(400, abs=1)


def test_a_low_pass_takes_a_sine_down_as_its_own_response_says_twice(capture):
    times = capture.plates[0].times
    force = np.zeros((len(times), 3))
    force[:, 1] = 500 + 100 * np.sin(2 * np.pi * 8 * times)
    plate = replace(
        capture.plates[0], force_ground=force, moment_ground=np.cross(capture.plates[0].cop_ground, force)
    )
    wrong = recorded.low_passed(replace(capture, plates=(plate,)), 6.0).plates[0]
    b, a = butter(2, 6.0, fs=RATE)
    gain = np.abs(freqz(b, a, worN=[8.0], fs=RATE)[1][0]) ** 2
    middle = slice(500, 1500)
    np.testing.assert_allclose(
        wrong.force_ground[middle, 1], 500 + gain * 100 * np.sin(2 * np.pi * 8 * times[middle]), atol=0.5
    )


def test_a_filtered_plate_still_reads_nothing_without_load(recording):
    wrong = recorded.low_passed(recording.trials[0], 6.0)
    for plate, before in zip(wrong.plates, recording.trials[0].plates, strict=True):
        assert recorded.silent(plate).mean() == pytest.approx(recorded.silent(before).mean(), abs=0.1)
        on = recorded.loaded(plate, 100.0) & recorded.loaded(before, 100.0)
        rough = [np.std(np.diff(p.force_ground[:, 1], 2)[on[1:-1]]) for p in (plate, before)]
        assert rough[0] < 0.1 * rough[1]


def test_cutting_keeps_markers_and_forces_together(capture):
    short = recorded.cut(capture, 20, 120)
    assert short.markers.frames == 100
    np.testing.assert_allclose(short.plates[0].force_ground[0, 1], time_history(0.2))
    np.testing.assert_allclose(short.plates[0].times[[0, -1]], [0.0, 0.99])


@pytest.fixture(scope="module")
def segment():
    """Four markers of a rigid body that turns and travels."""
    rng = np.random.default_rng(3)
    t = np.arange(120) / 100
    turn = Rotation.from_rotvec(np.stack([0.5 * np.sin(3 * t), 0.9 * t, 0.3 * np.cos(2 * t)], axis=1))
    shape = rng.uniform(-0.1, 0.1, (4, 3))
    points = np.stack([turn.apply(p) for p in shape], axis=1) + t[:, None, None] * np.array([1.0, 0.1, 0])
    return Markers(tuple("ABCD"), points, 100.0), turn


def test_registration_finds_the_turning_of_the_body(segment):
    markers, turn = segment
    R, centroid = recorded.follow_markers(markers, list("ABCD"))
    relative = R @ R[0].T
    np.testing.assert_allclose(relative, (turn * turn[0].inv()).as_matrix(), atol=1e-9)
    np.testing.assert_allclose(centroid, markers.positions_ground.mean(axis=1), atol=1e-9)


def test_registration_bridges_gaps(segment):
    markers, _ = segment
    positions = markers.positions_ground.copy()
    positions[40:44] = np.nan
    positions[60:70, 2] = np.nan
    R, _ = recorded.follow_markers(Markers(markers.names, positions, 100.0), list("ABCD"))
    whole, _ = recorded.follow_markers(markers, list("ABCD"))
    relative = np.einsum("tji,tjk->tik", R, whole)
    angles = Rotation.from_matrix(relative @ relative[0].T).magnitude()
    assert angles.max() < 0.01


def test_a_slipped_marker_stays_where_it_slipped_to_in_the_body(segment):
    markers, turn = segment
    R, _ = recorded.follow_markers(markers, list("ABCD"))
    wrong = recorded.slip_marker(markers, "B", np.array([0.009, -0.012, 0.0]), 0.5, R)
    in_body = np.stack(
        [turn[t].inv().apply((wrong.positions_ground - markers.positions_ground)[t]) for t in range(120)]
    )
    assert not in_body[:50].any()
    np.testing.assert_allclose(np.linalg.norm(in_body[50:, 1], axis=1), 0.015)
    np.testing.assert_allclose(in_body[50:, 1], in_body[50, 1] * np.ones((70, 1)), atol=1e-9)
    assert not in_body[:, [0, 2, 3]].any()


def test_a_swap_exchanges_two_and_ends(segment):
    markers, _ = segment
    wrong = recorded.swap_markers(markers, "A", "D", 20, 30).positions_ground
    true = markers.positions_ground
    np.testing.assert_array_equal(wrong[20:30, 0], true[20:30, 3])
    np.testing.assert_array_equal(wrong[20:30, 3], true[20:30, 0])
    np.testing.assert_array_equal(wrong[[19, 30]], true[[19, 30]])


def test_a_scale_multiplies_every_distance(segment):
    markers, _ = segment
    wrong = recorded.scale_markers(markers, 1.01).positions_ground
    far = lambda p: np.linalg.norm(p[:, 0] - p[:, 3], axis=1)  # noqa: E731
    np.testing.assert_allclose(far(wrong), 1.01 * far(markers.positions_ground))


def test_soft_tissue_moves_a_segments_markers_alike_and_with_the_joint_angle(recording, walk_world):
    markers = recording.trials[0].markers
    names = {
        b: [n for n, body in recording.marker_bodies.items() if body == b] for b in ("femur_r", "tibia_r")
    }
    R, R_next = (recorded.follow_markers(markers, names[b])[0] for b in ("femur_r", "tibia_r"))
    direction = np.array([[0.2, 0.5, 1.0], [0.0, 0.3, 0.4], [0.1, 0.0, 0.7]])
    wrong = recorded.soft(
        markers, names["femur_r"], R_ground=R, R_next=R_next, direction=direction, rms_m=0.010
    )
    moved = wrong.positions_ground - markers.positions_ground
    columns = [markers.names.index(n) for n in names["femur_r"]]
    assert np.sqrt(np.nanmean(np.sum(moved[:, columns] ** 2, axis=2))) == pytest.approx(0.010, rel=0.02)
    others = np.delete(np.arange(len(markers.names)), columns)
    assert not np.nan_to_num(moved[:, others]).any()
    spread = np.nanmax(moved[:, columns], axis=1) - np.nanmin(moved[:, columns], axis=1)
    assert np.nanmax(np.abs(spread)) < 1e-12
    motion = walk_world.trial.frames(100.0)
    knee = motion.q[:, motion.dofs.index("knee_angle_r")]
    poses = body_poses(walk_world.body.skeleton, motion.q)[0]
    femur = poses[:, walk_world.body.skeleton.body_index("femur_r")]
    in_body = np.einsum("tji,tj->ti", femur, moved[:, columns[0]])
    seen = np.isfinite(in_body).all(axis=1)
    design = np.stack([np.ones(seen.sum()), knee[seen]], axis=1)
    left = in_body[seen] - design @ np.linalg.lstsq(design, in_body[seen], rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.25 * np.sqrt(np.mean(in_body[seen] ** 2))
