"""Causes in the scene, on a server that nobody looks at."""

import numpy as np
import pytest

from addb_viewer.trial_view.palette import BONE, CAUSE_SURFACE
from tests.addb_viewer.app.scene.conftest import MESHES


@pytest.fixture
def push(effect):
    return effect("external_contact", "pelvis", ((20, 60),), force_x_N=50.0, force_y_N=0.0, force_z_N=0.0)


def test_an_arrow_stands_at_the_body_on_its_frames_and_the_bone_is_marked(scene, figures, push):
    scene.explain(figures(push))
    scene.draw(40)
    (cause,) = scene.causes.one_by_one
    assert cause.arrow.visible
    assert cause.label.handle.visible
    np.testing.assert_allclose(cause.arrow.points[0], [[0.4, 1.0, 0.0], [0.6, 1.0, 0.0]], atol=1e-6)
    assert tuple(scene.bodies.handles[0].color) == CAUSE_SURFACE
    scene.draw(60)
    assert not cause.arrow.visible
    assert not cause.label.handle.visible
    assert tuple(scene.bodies.handles[0].color) == BONE


def test_a_marked_marker_follows_it_and_goes_while_it_is_lost(scene, effect, figures):
    scene.explain(figures(effect("marker_slip", "L", ((40, 200),), shift_m=0.02)))
    (cause,) = scene.causes.one_by_one
    scene.draw(45)
    assert cause.marks[0].visible
    np.testing.assert_allclose(cause.marks[0].position, [0.45, 1.0, -0.1])
    scene.draw(55)  # lost
    assert not cause.marks[0].visible
    scene.draw(30)
    assert not cause.marks[0].visible


def test_labels_without_a_place_stand_below_one_another_above_the_person(scene, effect, figures):
    scene.explain(
        figures(effect("clock_offset", "all", offset_s=0.01), effect("capture_scale", "all", scale=1.01))
    )
    scene.draw(100)
    first, second = (cause.label.handle.position for cause in scene.causes.one_by_one)
    assert first[0] == second[0] == pytest.approx(1.0)
    assert abs(first[1] - second[1]) > 0.05


def test_a_moved_plate_a_band_and_a_load_are_there(scene, effect, figures):
    scene.explain(
        figures(
            effect("plate_position", "plate_1", shift_x_m=0.02, shift_z_m=0.0),
            effect(
                "elastic_tether",
                "pelvis",
                mean_force_N=30.0,
                anchor_x_m=0.0,
                anchor_y_m=1.0,
                anchor_z_m=2.0,
            ),
            effect("carried_mass", "pelvis", mass_kg=3.0),
        )
    )  # fmt: skip
    scene.draw(0)
    plate, band, load = scene.causes.one_by_one
    assert [node.visible for node in plate.still] == [True]
    assert band.band.visible
    np.testing.assert_allclose(band.band.points[0], [[0, 1, 0], [0, 1, 2]])
    assert load.ball.visible


def test_they_can_be_switched_off_and_leave_with_the_diagnosis(scene, server, figures, push):
    scene.explain(figures(push))
    scene.options.causes = False
    scene.draw(40)
    assert not scene.causes.one_by_one[0].arrow.visible
    assert tuple(scene.bodies.handles[0].color) == BONE
    scene.explain(None)
    assert server.scene.get_handle_by_name("/lab/trial/causes/0/force") is None
    scene.draw(40)


def test_they_come_with_every_trial_they_act_in(scene, make_replay, figures, push):
    scene.explain(figures(push))
    scene.show(make_replay("run"), MESHES)
    assert scene.causes.one_by_one == []
    scene.show(make_replay("walk"), MESHES)
    assert len(scene.causes.one_by_one) == 1


def test_labels_of_causes_at_one_place_do_not_lie_over_another(scene, effect, figures):
    scene.explain(figures(*(effect("carried_mass", "pelvis", mass_kg=kg) for kg in (2.0, 3.0, 4.0))))
    scene.draw(0)
    heights = sorted(cause.label.handle.position[1] for cause in scene.causes.one_by_one)
    assert np.diff(heights).min() > 0.05


def test_a_force_that_would_hardly_be_seen_has_no_arrow(scene, effect, figures):
    scene.explain(figures(effect("body_weight_support", "pelvis", force_N=1.0)))
    scene.draw(0)
    (cause,) = scene.causes.one_by_one
    assert not cause.arrow.visible
    assert cause.label.handle.visible
