"""What is drawn of a cause, and where."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from addb_viewer.trial_view.cause_pictures import LOAD_DENSITY, pictures
from solver.diagnosis.causes.catalogue import IDS, MARKER_IDS


@pytest.fixture(scope="session")
def picture_of(effect, figures):
    def of(replay, *args, **kwargs):
        (picture,) = pictures(figures(effect(*args, **kwargs)), replay)
        return picture

    return of


def test_a_contact_pushes_at_its_point_of_the_turned_body_on_its_frames(make_replay, picture_of):
    replay = make_replay()
    turned = Rotation.from_euler("y", 90, degrees=True)
    wxyz = np.tile(turned.as_quat()[[3, 0, 1, 2]], (200, 1, 1))
    replay = replace(replay, bodies=replace(replay.bodies, wxyz=wxyz))
    picture = picture_of(
        replay, "external_contact", "pelvis", frames=((20, 30), (50, 60)),
        force_x_N=3.0, force_y_N=40.0, force_z_N=-2.0, point_x_m=0.1, point_y_m=0.0, point_z_m=0.0,
    )  # fmt: skip
    assert picture.acts.sum() == 20
    assert picture.acts[[20, 29, 50]].all()
    assert not picture.acts[[19, 30, 60]].any()
    # x of a body that is turned by 90 degrees about y points to -z of the ground.
    np.testing.assert_allclose(picture.place[25], [0.25, 1.0, -0.1], atol=1e-12)
    np.testing.assert_allclose(picture.force[25], [3.0, 40.0, -2.0])
    assert picture.label == "an unmeasured contact, 40 N"
    assert picture.bodies == (0,)


def test_a_contact_whose_time_history_is_known_pushes_as_it_was_fitted(make_replay, effect, figures):
    replay = make_replay()
    for id_, mean in (
        ("external_contact", {"force_x_N": 3.0, "force_y_N": 40.0, "force_z_N": 0.0}),
        ("off_plate_step", {"force_y_N": 40.0}),
    ):
        contact = effect(id_, "pelvis", frames=((20, 26), (50, 60)), **mean)
        contact["time_histories"] = [
            {"trial": "walk", "start": 20, "step": 2, "force_N": [[0, 10, 0], [0, 20, 0], [0, 30, 4]]},
            {"trial": "walk", "start": 50, "step": 2, "force_N": [[0, 5, 0]] * 5},
            {"trial": "run", "start": 20, "step": 2, "force_N": [[9, 9, 9]]},
        ]
        (picture,) = pictures(figures(contact), replay)
        np.testing.assert_allclose(picture.force[[20, 21, 23, 24, 25]], [
            [0, 10, 0], [0, 15, 0], [0, 25, 2], [0, 30, 4], [0, 30, 4],
        ])  # fmt: skip
        assert np.isfinite(picture.force[picture.acts]).all()
        assert picture.label.endswith(", 40 N")  # the mean, as the panel says it
        assert np.isnan(picture.force[[19, 26, 60]]).all()


def test_what_is_large_is_drawn_like_ground_forces(make_replay, picture_of):
    lengths = {}
    for force_N in (200.0, 600.0):
        picture = picture_of(make_replay(), "body_weight_support", "pelvis", force_N=force_N)
        lengths[force_N] = picture.metres_per_newton * np.linalg.norm(picture.force[10])
    assert lengths == pytest.approx({200.0: 0.8, 600.0: 0.6})


def test_a_support_lifts_at_the_centre_of_mass(make_replay, picture_of):
    replay = make_replay()
    com = np.array([[0.0, 0.2, 0.0]])
    replay = replace(replay, bodies=replace(replay.bodies, com_body=com))
    picture = picture_of(replay, "body_weight_support", "pelvis", force_N=121.0)
    np.testing.assert_allclose(picture.place[10], [0.1, 1.2, 0.0])
    np.testing.assert_allclose(picture.force[10], [0.0, 121.0, 0.0])


def test_a_band_pulls_towards_its_anchor_the_more_the_longer_it_is(make_replay, picture_of):
    picture = picture_of(
        make_replay(), "elastic_tether", "pelvis", stiffness_N_per_m=100.0, mean_force_N=50.0,
        anchor_x_m=-1.0, anchor_y_m=1.0, anchor_z_m=0.0, rest_length_m=0.5,
    )  # fmt: skip
    np.testing.assert_allclose(picture.force[[0, 100]], [[-50.0, 0, 0], [-150.0, 0, 0]])
    np.testing.assert_allclose(picture.anchor, [-1.0, 1.0, 0.0])


def test_drag_is_against_the_motion(make_replay, picture_of):
    picture = picture_of(make_replay(), "drag", "pelvis", b_Ns_per_m=30.0, mean_force_N=30.0, exponent=2.0)
    np.testing.assert_allclose(picture.force[50], [-30.0, 0, 0], atol=1e-9)  # at 1 m/s


def test_a_load_is_a_ball_of_its_mass_where_it_is_carried(make_replay, picture_of):
    picture = picture_of(
        make_replay(), "carried_mass", "pelvis", mass_kg=7.0, offset_x_m=-0.1, offset_y_m=0.0, offset_z_m=0.2
    )
    np.testing.assert_allclose(picture.place[0], [-0.1, 1.0, 0.2])
    assert 4 / 3 * np.pi * picture.radius**3 * LOAD_DENSITY == pytest.approx(7.0)
    assert "7 kg" in picture.label


def test_a_shifted_plate_is_drawn_where_it_really_lies(make_replay, picture_of):
    replay = make_replay()
    picture = picture_of(replay, "plate_position", "plate_2", shift_x_m=0.02, shift_z_m=-0.01)
    true = replay.plates[1].corners - [0.02, 0.0, -0.01]  # recorded - true = shift
    np.testing.assert_allclose(picture.outline[:, 0], true)
    np.testing.assert_allclose(picture.outline[:, 1], np.roll(true, -1, axis=0))
    assert "it lies here" in picture.label


def test_a_turned_plate_is_turned_back_about_its_centre(make_replay, picture_of):
    replay = make_replay()
    picture = picture_of(replay, "plate_yaw", "plate_1", yaw_deg=90.0)
    centre = replay.plates[0].corners.mean(axis=0)
    before, after = replay.plates[0].corners - centre, picture.outline[:, 0] - centre
    # recorded = R_y(90°) true, which takes z to x and x to -z; so backwards x to z and z to -x.
    turned = np.stack([-before[:, 2], before[:, 1], before[:, 0]], axis=1)
    np.testing.assert_allclose(after, turned, atol=1e-12)


def test_a_plate_without_corners_is_where_it_was_loaded(make_replay, picture_of):
    replay = make_replay()
    bare = tuple(replace(plate, corners=None) for plate in replay.plates)
    picture = picture_of(replace(replay, plates=bare), "plate_gain", "plate_2", gain_error=0.04)
    low, high = picture.outline[:, 0].min(axis=0), picture.outline[:, 0].max(axis=0)
    np.testing.assert_allclose([low[0], high[0]], [0.6, 1.19])
    assert picture_of(replay, "plate_gain", "plate_9", gain_error=0.04).outline is None


def test_exchanged_plates_are_both_outlined(make_replay, picture_of):
    assert len(picture_of(make_replay(), "plate_swap", "plate_1+plate_2").outline) == 8


def test_markers_that_slipped_or_were_exchanged_are_marked(make_replay, picture_of):
    replay = make_replay()
    assert picture_of(replay, "marker_slip", "RTOE", shift_m=0.02).markers == (3,)
    assert picture_of(replay, "marker_swap", "R+L").markers == (1, 2)
    assert picture_of(replay, "marker_slip", "not there", shift_m=0.02).markers == ()


def test_a_step_beside_the_plates_marks_foot_and_toes(make_replay, picture_of):
    replay = make_replay()
    names = ("pelvis", "calcn_r", "toes_r")
    bodies = replace(
        replay.bodies,
        names=names,
        wxyz=np.repeat(replay.bodies.wxyz, 3, axis=1),
        position=np.repeat(replay.bodies.position, 3, axis=1),
    )
    picture = picture_of(replace(replay, bodies=bodies), "off_plate_step", "calcn_r", force_y_N=500.0)
    assert picture.bodies == (1, 2)
    np.testing.assert_allclose(picture.force[0], [0, 500, 0])


def test_what_is_unexplained_acts_at_its_body(make_replay, figures):
    location = {
        "body": "pelvis", "rms_force_N": 55.0, "mean_force_N": [3.0, 40.0, -2.0], "depends_on": "constant"
    }  # fmt: skip
    (picture,) = pictures(figures(verdict="unexplained", location=location), make_replay())
    assert picture.label == "unexplained: pelvis, 55 N RMS"
    np.testing.assert_allclose(picture.place[10], [0.1, 1.0, 0.0])


def test_a_cause_of_another_trial_is_not_drawn(make_replay, effect, figures):
    assert pictures(figures(effect("clock_offset", "all", offset_s=0.01)), make_replay("run")) == ()
    several = figures({**effect("marker_slip", "R"), "frames": [["run", 0, 5], ["walk", 7, 9]]})
    (picture,) = pictures(several, make_replay())
    assert np.flatnonzero(picture.acts).tolist() == [7, 8]


@pytest.mark.parametrize("id_", [*IDS, *MARKER_IDS, "something_new"])
def test_every_cause_has_at_least_a_label(make_replay, picture_of, id_):
    for replay in (make_replay(), make_replay(fitted=False, plates=0)):
        for target in ("pelvis", "plate_1", "all", "nowhere", "xz"):
            picture = picture_of(replay, id_, target)
            assert picture.label
            assert picture.acts.all()
