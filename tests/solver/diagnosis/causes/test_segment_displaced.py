"""Slips of neighbouring segments at one moment are one event; others stay what they are."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Range
from solver.diagnosis.causes.leaps import Leap
from solver.diagnosis.causes.marker_slip import MarkerSlip
from solver.diagnosis.causes.segment_displaced import SegmentDisplaced, of_leap, slips_together
from solver.diagnosis.causes.soft_tissue import SoftTissue
from tests.solver.diagnosis.tracked_markers import SHIFT_M, slip


def marker_of(scene, body, nth=0):
    own = np.flatnonzero(scene.markers.body == scene.skeleton.body_index(body))
    return int(own[nth])


def together(scene, *found):
    return slips_together(found, {scene.name: scene, "other": scene})


def test_two_of_a_segment_and_one_of_its_neighbour_are_one_event(scene):
    two = [slip(scene, marker_of(scene, "pelvis", k), 100 + 3 * k, 0.02 + 0.01 * k) for k in range(2)]
    (event,) = together(scene, *two, slip(scene, marker_of(scene, "femur_r"), 105, 0.04))
    assert isinstance(event, SegmentDisplaced)
    assert set(event.target.split("+")) == {"pelvis", "femur_r"}
    assert event.parameters["shift_m"].value == pytest.approx(0.03)
    assert event.parameters["time_s"].value == pytest.approx(100 / scene.rate)
    assert event.frames.start == 100
    assert event.gain == 40.0


@pytest.mark.parametrize(
    "other",
    [
        lambda scene: slip(scene, marker_of(scene, "pelvis", 1), 100 + round(0.2 * scene.rate)),
        lambda scene: slip(scene, marker_of(scene, "calcn_l")),
        lambda scene: slip(scene, marker_of(scene, "pelvis", 1), trial="other"),
        lambda scene: slip(scene, marker_of(scene, "pelvis", 0), 102),
    ],
    ids=["later", "far away", "in another trial", "of the same marker"],
)
def test_what_does_not_belong_together_stays_apart(scene, other):
    one, two = slip(scene, marker_of(scene, "pelvis")), other(scene)
    assert together(scene, one, two) == [one, two]


def test_a_slip_between_two_joins_them_whatever_the_order(scene):
    """Pelvis and shank are no neighbours; foot and shank are, with an ankle bone without markers between."""
    shank, pelvis, thigh = (slip(scene, marker_of(scene, b)) for b in ("tibia_r", "pelvis", "femur_r"))
    foot = slip(scene, marker_of(scene, "calcn_r"))
    assert len(together(scene, shank, foot)) == 1
    assert len(together(scene, shank, pelvis)) == 2
    assert len(together(scene, shank, pelvis, thigh)) == 1


def test_other_findings_are_left_alone(scene):
    soft_tissue = SoftTissue("femur_r", {}, Range(scene.name, 0, scene.frames), 30.0, (0,), np.zeros((1, 3)))
    one = slip(scene, marker_of(scene, "pelvis"))
    assert together(scene, soft_tissue, one) == [soft_tissue, one]


def test_repair_puts_every_marker_back(scene):
    markers = [marker_of(scene, "pelvis", k) for k in range(2)]
    observed = scene.markers.observed_ground
    carried = observed.copy()
    R = scene.R_ground_body[:, scene.markers.body[markers[0]]]
    for frame in range(100, scene.frames):
        for m in markers:
            carried[frame, m] += R[frame] @ SHIFT_M
    moved = replace(scene, markers=replace(scene.markers, observed_ground=carried))
    (event,) = together(moved, *(slip(moved, m) for m in markers))
    np.testing.assert_allclose(event.repair(carried), observed, atol=1e-12)


def leap_of(scene, markers, shifts_ground):
    return Leap(tuple(markers), 100, np.array(shifts_ground), 0.0005)


def test_a_leap_of_one_marker_is_its_slip_and_undoing_it_puts_it_back(scene):
    m = marker_of(scene, "femur_r")
    R = scene.R_ground_body[:, scene.markers.body[m]]
    names = ("WAND", *scene.markers.names)
    found = of_leap(scene, leap_of(scene, [m + 1], [R[100] @ SHIFT_M]), names)
    assert isinstance(found, MarkerSlip)
    assert found.target == scene.markers.names[m]
    observed = scene.markers.observed_ground
    carried = observed.copy()
    carried[100:, m] += R[100:] @ SHIFT_M
    np.testing.assert_allclose(found.repair(carried), observed, atol=1e-12)


def test_a_leap_of_several_is_one_event_on_the_segments_of_those_that_the_model_has(scene):
    markers = [marker_of(scene, "pelvis"), marker_of(scene, "femur_r"), len(scene.markers.names)]
    found = of_leap(scene, leap_of(scene, markers, [SHIFT_M] * 3), (*scene.markers.names, "WAND"))
    assert isinstance(found, SegmentDisplaced)
    assert set(found.target.split("+")) == {"pelvis", "femur_r"}
    assert len(found.slips) == 2
    assert found.parameters["shift_m"].value == pytest.approx(np.linalg.norm(SHIFT_M))


def test_markers_that_the_model_lacks_are_named_alone_and_change_nothing(scene):
    names = (*scene.markers.names, "WAND", "ROD")
    first = len(scene.markers.names)
    found = of_leap(scene, leap_of(scene, [first], [SHIFT_M]), names)
    assert (found.id, found.target) == ("marker_slip", "WAND")
    observed = scene.markers.observed_ground
    assert found.repair(observed) is observed
    assert of_leap(scene, leap_of(scene, [first, first + 1], [SHIFT_M] * 2), names) is None
