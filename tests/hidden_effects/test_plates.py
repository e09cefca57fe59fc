"""Each change of a plate against the catalogue's sentence, said in other words."""

import numpy as np
import pytest

from solver.simulate.faults import recorded


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
    wrong = recorded.gained(plate, 0.04)
    np.testing.assert_allclose(wrong.force_ground, 1.04 * plate.force_ground)
    np.testing.assert_allclose(wrong.moment_ground, 1.04 * plate.moment_ground)
    np.testing.assert_array_equal(wrong.cop_ground, plate.cop_ground)


def test_a_bias_has_no_moment_about_the_plates_centre(plate):
    bias = np.array([3.0, -12.0, 7.0])
    wrong = recorded.biased(plate, bias, while_unloaded=False)
    on = recorded.loaded(plate)
    np.testing.assert_allclose((wrong.force_ground - plate.force_ground)[on], np.tile(bias, (on.sum(), 1)))
    middle = (plate.cop_ground[on].min(axis=0) + plate.cop_ground[on].max(axis=0)) / 2
    np.testing.assert_allclose(moment_about(wrong, middle), moment_about(plate, middle), atol=1e-9)
    assert np.nanmax(levers(wrong)) < 1e-9


def test_a_downward_bias_draws_the_centre_of_pressure_away_from_the_centre(plate):
    wrong = recorded.biased(plate, np.array([0.0, -12.0, 0.0]), while_unloaded=False)
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
        recorded.biased(plate, bias, True).force_ground[off], np.tile(bias, (off.sum(), 1))
    )
    assert not recorded.biased(plate, bias, False).force_ground[off].any()


def test_a_plate_in_the_wrong_place_moves_its_centre_of_pressure_alone(plate):
    shift = np.array([0.010, 0.0, -0.006])
    wrong = recorded.moved(plate, shift)
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
    wrong = recorded.turned(plate, 90.0)
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
    wrong = recorded.tilted(plate, 0.0, 1.0)
    on = recorded.loaded(plate)
    expected = (
        np.cos(np.radians(1)) * plate.force_ground[on, 0] - np.sin(np.radians(1)) * plate.force_ground[on, 1]
    )
    np.testing.assert_allclose(wrong.force_ground[on, 0], expected, atol=1e-9)
    np.testing.assert_array_equal(wrong.cop_ground, plate.cop_ground)
    about_x = recorded.tilted(plate, 1.0, 0.0).force_ground[on, 2]
    expected = (
        np.cos(np.radians(1)) * plate.force_ground[on, 2] + np.sin(np.radians(1)) * plate.force_ground[on, 1]
    )
    np.testing.assert_allclose(about_x, expected, atol=1e-9)


def test_exchanged_plates_keep_their_centres_of_pressure(recording):
    one, other = recording.trials[0].plates
    a, b = recorded.exchanged(one, other)
    np.testing.assert_array_equal(a.force_ground, other.force_ground)
    np.testing.assert_array_equal(b.force_ground, one.force_ground)
    np.testing.assert_array_equal(a.cop_ground, one.cop_ground)
    np.testing.assert_array_equal(b.cop_ground, other.cop_ground)
    np.testing.assert_allclose(recorded.free_moment(a), recorded.free_moment(other), atol=1e-9)


@pytest.mark.parametrize(
    ("axes", "matrix"),
    [
        ("x", np.diag([-1.0, 1, 1])),
        ("z", np.diag([1.0, 1, -1])),
        ("xz", np.eye(3)[[2, 1, 0]]),
    ],
)
def test_axes_read_wrongly_change_the_force_alone(plate, axes, matrix):
    wrong = recorded.misread_axes(plate, axes)
    np.testing.assert_allclose(wrong.force_ground, plate.force_ground @ matrix.T)
    np.testing.assert_array_equal(wrong.cop_ground, plate.cop_ground)
    np.testing.assert_allclose(recorded.free_moment(wrong), recorded.free_moment(plate), atol=1e-9)


def test_a_blanked_stance_leaves_the_others(plate):
    stance = recorded.stances(plate)[0]
    wrong = recorded.blanked(plate, stance)
    assert not wrong.force_ground[stance].any()
    assert np.isnan(wrong.cop_ground[stance]).all()
    rest = np.ones(plate.samples, dtype=bool)
    rest[stance] = False
    np.testing.assert_array_equal(wrong.force_ground[rest], plate.force_ground[rest])


def test_a_stance_is_whole(plate):
    for stance in recorded.stances(plate):
        assert recorded.loaded(plate)[stance].all()
        assert not recorded.loaded(plate)[[stance.start - 1, stance.stop]].any()
