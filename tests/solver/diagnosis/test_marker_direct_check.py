"""A slip against several markers that moved together, by the distances between markers."""

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.marker_slip import MarkerSlip
from solver.diagnosis.causes.segment_displaced import SegmentDisplaced
from solver.diagnosis.direct_checks.statement import About, Statement
from solver.diagnosis.marker_causes import SeenInMarkers, as_distances_tell

FRAME = 40


@pytest.fixture
def thigh(short_scene):
    """Names of the right thigh's markers; the first one seems to slip."""
    own = np.flatnonzero(short_scene.markers.body == short_scene.skeleton.body_index("femur_r"))
    return [short_scene.markers.names[m] for m in own]


@pytest.fixture
def slip(short_scene, thigh):
    marker = short_scene.markers.names.index(thigh[0])
    return MarkerSlip(
        target=thigh[0],
        parameters={"shift_m": Estimate(0.02, 0.001), "time_s": Estimate(FRAME / short_scene.rate, 0.01)},
        frames=Range(short_scene.name, FRAME, short_scene.frames),
        gain=50.0,
        marker=marker,
        body=int(short_scene.markers.body[marker]),
        shift_body=np.array([0.02, 0.0, 0.0]),
        R_ground_body=short_scene.R_ground_body[:, short_scene.markers.body[marker]],
    )


def said(scene, markers, later_s=0.0, trial=None, **nats):
    time_s = scene.motion.start_time + FRAME / scene.rate + later_s
    return Statement(
        "rigid distances",
        "…",
        {About(k): v for k, v in nats.items()},
        {"time_s": time_s, "change_m": 0.031},
        trial=trial or scene.name,
        target="+".join(markers),
    )


def test_those_that_moved_together_are_named_in_place_of_the_one_that_stayed(short_scene, thigh, slip):
    statement = said(short_scene, [*thigh[1:], "WAND"], segment=6.0)
    (told,) = as_distances_tell(SeenInMarkers((slip,)), [statement], [short_scene]).findings
    assert isinstance(told, SegmentDisplaced)
    assert told.target == "femur_r"
    assert told.parameters["shift_m"].value == 0.031
    assert told.frames == slip.frames
    observed = short_scene.markers.observed_ground
    np.testing.assert_array_equal(told.repaired(observed), slip.repaired(observed))


@pytest.mark.parametrize(
    "statement",
    [
        lambda scene, thigh: said(scene, thigh[1:], segment=4.0),
        lambda scene, thigh: said(scene, thigh[1:], slip=9.0, segment=-1.0),
        lambda scene, thigh: said(scene, thigh[1:], later_s=0.3, segment=9.0),
        lambda scene, thigh: said(scene, thigh[1:], trial="other", segment=9.0),
        lambda scene, thigh: said(scene, thigh, segment=9.0),
        lambda scene, thigh: said(scene, ["WAND", "ROD"], segment=9.0),
    ],
    ids=["too quiet", "of one marker", "later", "in another trial", "with it", "of no marker of the model"],
)
def test_any_other_word_leaves_the_slip(short_scene, thigh, slip, statement):
    told = as_distances_tell(SeenInMarkers((slip,)), [statement(short_scene, thigh)], [short_scene])
    assert told.findings == (slip,)
