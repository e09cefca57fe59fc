import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.common.errors import FitError
from solver.kinematics.marker_matching import match_markers
from solver.skeleton.skeleton import Marker


def recording(names, frames=4):
    return Markers(tuple(names), np.ones((frames, len(names), 3)), 100.0)


def renamed(crane, names):
    return crane.with_markers(
        [Marker(n, m.body, m.position_body) for n, m in zip(names, crane.markers, strict=False)]
    )


def test_exact_names_come_first_and_the_rest_is_listed(crane):
    match = match_markers(crane, [recording([*crane.marker_names, "WAND"])])
    assert match.model == crane.marker_names
    assert match.measured == tuple((name,) for name in crane.marker_names)
    assert any("WAND" in note for note in match.notes)


def test_case_and_punctuation_do_not_matter(crane):
    skeleton = renamed(crane, ["R.ASIS", "L.ASIS", "S2", "R.Knee", "R.Ankle", "R.Heel", "R.Toe", "C7"])
    match = match_markers(
        skeleton, [recording(["r_asis", "L_ASIS", "s2", "rknee", "R.ANKLE", "R.Heel", "RTOE"])]
    )
    assert [names[0] for names in match.measured] == [
        *("r_asis", "L_ASIS", "s2", "rknee", "R.ANKLE", "R.Heel", "RTOE")
    ]
    assert any("r_asis = R.ASIS" in note for note in match.notes)


def test_two_candidates_for_a_similar_name_are_not_guessed(crane):
    skeleton = renamed(crane, ["RASI", *[f"M{i}" for i in range(1, 10)]])
    match = match_markers(skeleton, [recording(["r.asi", "R_ASI", *[f"M{i}" for i in range(1, 10)]])])
    assert "RASI" not in match.model


def test_each_recording_may_spell_the_markers_in_its_own_way(crane):
    static = recording(crane.marker_names)
    walk = recording([f"Subject1:{name.upper()}" for name in crane.marker_names])
    match = match_markers(crane, [walk, static])
    assert match.model == crane.marker_names
    assert np.isfinite(match.observed(walk)).all()
    assert np.isfinite(match.observed(static)).all()


def test_the_nearest_way_of_writing_wins_over_a_looser_one(crane):
    rest = [f"M{i}" for i in range(1, 8)]
    skeleton = renamed(crane, ["RTOE", "R.Toe", *rest])
    match = match_markers(skeleton, [recording(["R_TOE", *rest])])
    assert dict(zip(match.model, match.measured, strict=True))["R.Toe"] == ("R_TOE",)
    assert "RTOE" not in match.model


def test_one_name_for_two_markers_of_the_model_is_not_guessed(crane):
    rest = [f"M{i}" for i in range(1, 8)]
    skeleton = renamed(crane, ["R.Toe", "R_Toe", *rest])
    match = match_markers(skeleton, [recording(["RTOE", *rest])])
    assert match.model == tuple(rest)
    assert any("left out: RTOE" in note for note in match.notes)


def test_markers_never_seen_are_left_out_and_named(crane):
    markers = recording(crane.marker_names)
    markers.positions_ground[:, 2] = np.nan
    match = match_markers(crane, [markers])
    assert crane.marker_names[2] not in match.model
    assert any("never seen" in note and crane.marker_names[2] in note for note in match.notes)


def test_segments_without_any_shared_marker_are_named(crane):
    last = max(marker.body for marker in crane.markers)
    names = [marker.name for marker in crane.markers if marker.body != last]
    match = match_markers(crane, [recording(names)])
    expected = (
        f"no marker of the recordings shows the motion of {crane.bodies[last].name}; they are kept near the "
        "neutral pose, and have no angles"
    )
    assert expected in match.notes
    assert expected not in match_markers(crane, [recording(crane.marker_names)]).notes


def test_a_trial_without_a_shared_marker_has_gaps_there(crane):
    short = recording(crane.marker_names[:-1])
    match = match_markers(crane, [recording(crane.marker_names), short])
    assert np.isnan(match.observed(short)[:, -1]).all()


def test_unknown_marker_sets_are_an_error_with_the_nearest_names(crane):
    skeleton = renamed(crane, ["RASI", "LASI", "RKNE", "RANK", "RHEE", "RTOE", "C7"])
    with pytest.raises(FitError, match=r"RASIS \(nearest: RASI"):
        match_markers(skeleton, [recording(["RASIS", "KNEE1", "foo", "bar"])])
