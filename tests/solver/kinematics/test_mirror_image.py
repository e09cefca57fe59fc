"""Left and right exchanged over a whole recording, by its labels or by an axis."""

import pytest

from solver.common.notes import Kind
from solver.kinematics.mirror_image import mirror_notes
from solver.kinematics.settings import KinematicsSettings
from solver.markers.atlas import landmark_marker
from solver.skeleton.default_body import default_skeleton


@pytest.fixture(scope="module")
def notes_of(walker):
    """What is noted of the walker's markers at landmarks that end so, as they are moved."""
    markers, places = walker

    def noted(moved, *endings):
        body = default_skeleton()
        some = [i for i, label in enumerate(markers.names) if places[label].name.endswith(endings)]
        chosen = [markers.names[i] for i in some]
        marked = body.with_markers([landmark_marker(places[label], label, body) for label in chosen])
        return mirror_notes(marked, moved(markers.positions_ground[:, some]), KinematicsSettings())

    return noted


@pytest.mark.parametrize("turned", [(-1, 1, 1), (1, 1, -1), (-1, -1, -1)])
def test_a_person_in_a_mirror_is_noted(notes_of, turned):
    (note,) = notes_of(lambda x: x * turned, "")
    assert note.kind is Kind.WRONG_LABELS
    assert "left and right are exchanged" in note


@pytest.mark.parametrize("few", [("asis", "psis", "heel"), ("knee_lateral", "ankle_lateral", "acromion")])
def test_few_markers_tell_as_well(notes_of, few):
    names = tuple(f"{name}_{side}" for name in few for side in "rl")
    assert notes_of(lambda x: x, *names) == ()
    assert notes_of(lambda x: x[..., ::-1], *names)


@pytest.mark.parametrize("turned", [(1, 1, 1), (-1, 1, -1), (1, -1, -1)])
def test_a_person_who_is_only_turned_is_not(notes_of, turned):
    assert notes_of(lambda x: x * turned, "") == ()


@pytest.mark.parametrize("sign", [1, -1])
def test_markers_that_lie_in_one_plane_do_not_tell(notes_of, sign):
    assert notes_of(lambda x: x * (1, 1, sign), "knee_lateral_r", "ankle_lateral_r", "heel_r") == ()


def test_a_trial_without_a_well_seen_frame_has_no_note(notes_of):
    assert notes_of(lambda x: x[:0], "") == ()
