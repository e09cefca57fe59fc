"""The scene on a server that nobody looks at."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.app.scene.camera import DISTANCE, VIEWS, eye
from addb_viewer.app.scene.force_nodes import name_place, served_foot
from addb_viewer.app.scene.legend import BY_RESIDUAL, BY_TORQUE
from addb_viewer.app.scene.person_nodes import TRAIL_SEGMENTS, trail_rows
from addb_viewer.app.scene.scene import TrialScene, followed_path, heading
from addb_viewer.trial_view.forces_in_use import contact_words
from addb_viewer.trial_view.joint_loads import JointLoads
from addb_viewer.trial_view.palette import (
    BONE,
    CAUSE_SURFACE,
    GREEN,
    PURPLE,
    UNASSIGNED,
    UNSEEN,
    error_colors,
    foot_color,
    load_colors,
)
from addb_viewer.trial_view.replay import held
from tests.addb_viewer.app.scene.conftest import MESHES


def shown_color(arrow):
    return tuple(arrow.colors.tolist())


def test_a_lost_marker_stays_and_fades(scene):
    scene.draw(55)
    np.testing.assert_allclose(scene.markers.points.points[2], [0.49, 1.0, -0.1], atol=1e-6)
    assert tuple(scene.markers.points.colors[2]) == UNSEEN
    assert tuple(scene.markers.points.colors[1]) != UNSEEN
    # No line leads to a marker that is not there, and HEAD has no model marker.
    assert len(scene.markers.lines.points) == 3


def test_nothing_is_drawn_of_a_person_out_of_view_and_no_marker_before_it_comes(server, make_replay):
    whole = make_replay()
    measured, position = whole.markers.measured.copy(), whole.bodies.position.copy()
    away = slice(40, 50)
    position[away] = np.nan
    measured[away, 1:] = np.nan
    measured[:20, 0] = np.nan
    replay = replace(
        whole,
        markers=replace(whole.markers, measured=measured),
        bodies=replace(whole.bodies, position=position),
    )
    scene = TrialScene(server)
    scene.show(replay, MESHES)
    drawn = []
    for frame in (10, 30, 45, 60):
        scene.draw(frame)
        assert len(scene.markers.points.points) == len(scene.markers.points.colors)
        drawn.append(len(scene.markers.points.points))
    assert drawn == [4, 5, 1, 5]
    assert replay.first_in_view == 0
    assert not replay.in_view[away].any()
    assert "nobody is in view" in contact_words(replay, 45, None)
    assert "nobody is in view" not in contact_words(replay, 30, None)


def test_a_trial_opens_where_somebody_is_seen(make_replay):
    fitted = make_replay()
    position, measured = fitted.bodies.position.copy(), fitted.markers.measured.copy()
    position[:25], measured[:15] = np.nan, np.nan
    fitted = replace(fitted, bodies=replace(fitted.bodies, position=position))
    unfitted = replace(fitted, bodies=None, markers=replace(fitted.markers, measured=measured))
    assert (fitted.first_in_view, unfitted.first_in_view) == (25, 15)


def test_forces_start_at_their_centre_of_pressure_in_the_colour_of_the_foot(scene):
    scene.draw(30)
    right, left = scene.forces.arrows
    assert right.visible
    assert not left.visible
    np.testing.assert_allclose(right.points[0], [[0.3, 0, 0.1], [0.3, 0.7, 0.1]], atol=1e-6)
    assert shown_color(right) == GREEN.linear
    scene.draw(80)
    assert not right.visible
    assert left.visible
    assert shown_color(left) == PURPLE.linear


def test_a_force_that_goes_to_no_foot_is_told_apart(scene, make_replay):
    replay = make_replay()
    nobodys = replace(replay.plates[0], foot=np.full(replay.frames, -1))
    scene.show(replace(replay, plates=(nobodys,)), MESHES)
    scene.draw(30)
    assert shown_color(scene.forces.arrows[0]) == UNASSIGNED.linear


def test_small_forces_and_residuals_are_not_drawn(scene):
    scene.draw(10)  # 5 N
    assert not scene.forces.residual.visible
    scene.draw(150)
    assert scene.forces.residual.visible
    np.testing.assert_allclose(scene.forces.residual.points[0, 0], [1.5, 1.0, 0.0], atol=1e-6)


def test_options_switch_things_off(scene):
    scene.options.bones = scene.options.forces = scene.options.model_markers = False
    scene.draw(30)
    assert not scene.bodies.handles[0].visible
    assert not scene.forces.arrows[0].visible
    assert not scene.markers.model_points.visible
    scene.options.bones = scene.options.see_through = True
    scene.options.trail_seconds = 0.5
    scene.draw(60)
    assert scene.bodies.handles[0].opacity == pytest.approx(0.35)
    trails = scene.markers.trails.points
    # Four markers were seen all along; the fifth was lost at the end.
    assert 4 * TRAIL_SEGMENTS <= len(trails) < 5 * TRAIL_SEGMENTS
    assert trails[:, 1, 0].max() <= 0.701


def test_frames_without_a_pose_show_no_bones(scene, make_replay):
    replay = make_replay()
    replay.bodies.position[:50] = np.nan
    scene.show(replay, MESHES)
    scene.draw(10)
    assert not scene.bodies.handles[0].visible
    scene.draw(60)
    assert scene.bodies.handles[0].visible


def test_every_frame_of_every_kind_of_trial_draws(scene, make_replay):
    empty = make_replay(fitted=False, plates=0)
    unseen = replace(
        empty, markers=replace(empty.markers, measured=np.full_like(empty.markers.measured, np.nan))
    )
    for replay in (make_replay(frames=1), empty, unseen):
        scene.show(replay, MESHES)
        for frame in range(replay.frames):
            scene.draw(frame)
        assert np.isfinite(scene.center(0)).all()


def test_the_picture_glides_with_the_person(scene):
    for frame in (0, 100, 40):
        scene.draw(frame)
        np.testing.assert_allclose(scene.lab.position + scene.path[frame], 0, atol=1e-9)


def test_letting_go_and_following_again_never_jumps(scene):
    scene.draw(100)
    scene.follow(False, 100)
    scene.draw(160)
    np.testing.assert_allclose(scene.lab.position, [-1.0, 0, 0])
    scene.follow(True, 160)
    scene.draw(160)
    np.testing.assert_allclose(scene.lab.position, [-1.0, 0, 0])
    scene.draw(100)
    np.testing.assert_allclose(scene.lab.position, [-0.4, 0, 0], atol=1e-9)


def test_without_a_skeleton_the_markers_show_the_way(make_replay):
    replay = make_replay(fitted=False)
    path = followed_path(replay)
    assert np.isfinite(path).all()
    assert path[-1, 0] - path[0, 0] == pytest.approx(1.99, abs=0.1)
    np.testing.assert_allclose(heading(replay), [1, 0, 0], atol=1e-9)
    backwards = replace(replay, markers=replace(replay.markers, measured=replay.markers.measured[::-1]))
    np.testing.assert_allclose(heading(backwards), [-1, 0, 0], atol=1e-9)


def test_views_are_named_from_the_person_not_the_laboratory():
    center, facing_z = np.array([1.0, 0.9, 2.0]), np.array([0.0, 0.0, 1.0])
    front = eye(VIEWS["Front"], facing_z, center) - center
    side = eye(VIEWS["Side"], facing_z, center) - center
    top = eye(VIEWS["Top"], facing_z, center) - center
    assert front[2] > 0.99 * DISTANCE
    assert side[0] < -0.99 * DISTANCE  # facing z, the right hand is at -x
    assert top[1] > 0.99 * DISTANCE


def test_held_fills_gaps_before_within_and_after():
    positions = np.arange(15, dtype=float).reshape(5, 1, 3)
    seen = np.array([[False], [True], [False], [True], [False]])
    np.testing.assert_array_equal(held(positions, seen)[:, 0], positions[[1, 1, 1, 3, 3], 0])


@pytest.mark.parametrize(("frame", "seconds"), [(0, 1.0), (5, 1.0), (500, 1.0), (500, 0.1)])
def test_trails_end_at_the_present_frame(frame, seconds):
    rows = trail_rows(frame, seconds, 200.0)
    assert rows[-1] == frame
    assert rows[0] == max(0, frame - round(200 * seconds))
    assert len(rows) <= TRAIL_SEGMENTS + 1


def test_colours_redden_with_the_error_and_keep_unknown_ones_grey():
    colors = error_colors(np.array([0.0, 0.02, 0.04, 0.4, np.nan])).astype(int)
    red_over_blue = colors[:, 0] - colors[:, 2]
    assert red_over_blue[0] < red_over_blue[1] < red_over_blue[2] == red_over_blue[3]
    assert len(set(colors[4])) == 1


def test_feet_have_their_own_colours():
    assert foot_color("calcn_r", 1) == foot_color("R_Foot", 0) == GREEN
    assert foot_color("calcn_l", 0) == PURPLE
    assert foot_color("hoof", 0) != foot_color("hoof", 1)


def test_an_unloaded_plate_without_corners_is_nowhere(make_replay):
    plate = make_replay().plates[0]
    assert name_place(replace(plate, corners=None, force=np.zeros_like(plate.force))) is None


def test_a_plate_has_the_colour_of_the_foot_that_it_serves_and_none_where_two_share_it(scene, make_replay):
    replay = make_replay()
    first, second = replay.plates
    assert [served_foot(plate) for plate in replay.plates] == [0, 1]
    half = np.where(np.arange(replay.frames) < 30, 0, 1)
    assert served_foot(replace(first, foot=half)) is None
    assert served_foot(replace(first, foot=np.where(np.arange(replay.frames) < 57, 0, 1))) == 0
    assert served_foot(replace(second, foot=np.full(replay.frames, -2))) is None
    colors = [
        tuple(scene.server.scene.get_handle_by_name(f"/lab/trial/plates/{i}/surface").color) for i in (0, 1)
    ]
    assert colors == [GREEN, PURPLE]


def test_measured_and_required_total_stand_at_the_centre_of_mass_and_differ_by_the_residual(
    server, make_replay
):
    replay = make_replay()
    counted = np.tile([0.0, 700.0, 0.0], (replay.frames, 1))
    replay = replace(replay, residual=replace(replay.residual, counted=counted))
    scene = TrialScene(server)
    scene.show(replay, MESHES)
    scene.draw(199)
    (start, tip), com = scene.forces.total.measured.points[0], replay.residual.com[199]
    np.testing.assert_allclose(start, com, atol=1e-6)
    np.testing.assert_allclose(tip - start, [0.0, 0.7, 0.0], atol=1e-6)
    apex = scene.forces.total.required.points[-1, 1]
    np.testing.assert_allclose(apex - tip, 1e-3 * replay.residual.force[199], atol=1e-6)
    scene.options.total = False
    scene.draw(199)
    assert not scene.forces.total.measured.visible
    assert not scene.forces.total.required.visible


def test_bones_stand_where_the_fit_has_them_and_nowhere_else(scene, make_replay):
    scene.draw(30)
    (bone,) = scene.bodies.handles.values()
    np.testing.assert_allclose(bone.position, scene.replay.bodies.position[30, 0])
    np.testing.assert_allclose(bone.wxyz, scene.replay.bodies.wxyz[30, 0])
    scene.bodies.known[31] = False
    scene.draw(31)
    assert not bone.visible


def test_bones_show_torque_or_residual_darker_the_larger_and_causes_stay_marked(scene, make_replay):
    replay = make_replay()
    loads = np.linspace(0.0, 40.0, replay.frames)[:, None]
    loads[5] = np.nan
    scene.show(replace(replay, joint_loads=JointLoads(loads, 80.0)), MESHES)
    (bone,) = scene.bodies.handles.values()

    def brightness(frame):
        scene.draw(frame)
        return sum(bone.color)

    assert brightness(199) == sum(BONE), "colours are asked for"
    scene.options.tint = BY_TORQUE
    assert brightness(0) == brightness(5) == sum(BONE)
    assert brightness(0) > brightness(100) > brightness(199) > sum(load_colors(np.array(1.0)))
    assert "80 N·m" in scene.legend
    scene.options.tint = BY_RESIDUAL  # 0 to 100 N, where 35 N is the limit
    assert sum(BONE) > brightness(60) > brightness(199) == sum(load_colors(np.array(1.0)))
    assert "≥ 70 N" in scene.legend
    scene.bodies.draw(199, visible=True, see_through=False, marked={0}, tints=load_colors(np.array([1.0])))
    assert tuple(bone.color) == CAUSE_SURFACE
    scene.show(make_replay(fitted=False), MESHES)
    scene.draw(0)
    assert "no residual is known" in scene.legend
