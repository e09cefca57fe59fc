import numpy as np

from solver.capture.formats.point_labels import marker_points


def chosen(*labels, seen=None, computed=frozenset()):
    counts = np.full(len(labels), 10) if seen is None else np.array(seen)
    return marker_points(labels, counts, computed, "a.c3d")


def test_plain_labels_stay():
    assert chosen(" LASI ", "r.Heel").names == ("LASI", "r.Heel")
    assert chosen("LASI").notes == ()


def test_unlabelled_points_are_left_out():
    found = chosen("LASI", "*52", "Unlabeled 12", "", "unlabelled3", "RASI")
    assert found.names == ("LASI", "RASI")
    assert found.columns == (0, 5)
    assert "4 unlabelled" in found.notes[0]


def test_points_beyond_the_labels_are_unlabelled():
    found = marker_points(("LASI",), np.array([5, 5, 5]), frozenset(), "a.c3d")
    assert found.names == ("LASI",)
    assert "2 unlabelled" in found.notes[0]


def test_labels_beyond_the_points_are_ignored():
    assert marker_points(("A", "B", "0", ""), np.array([5, 5]), frozenset(), "a.c3d").names == ("A", "B")


def test_repeated_names():
    found = chosen("c7", "c7", "sacrum", "c7")
    assert found.names == ("c7", "c7#2", "sacrum", "c7#3")
    assert any("more than one marker is called c7" in note for note in found.notes)


def test_a_counterpart_that_was_never_seen_gives_way():
    found = chosen("RANK", "RANK", seen=[0, 9])
    assert found.names == ("RANK",)
    assert found.columns == (1,)


def test_computed_quantities():
    found = chosen(
        "LKneeAngles", "RHipMoment", "LGroundReactionForce", "R_Power", "LFoot", "Forces", "X", computed={"X"}
    )
    assert found.names == ("LFoot",)
    assert "LKneeAngles" in found.notes[0]


def test_names_that_only_sound_computed():
    names = ("RFOREARM", "LANGLE", "triangle", "Enforcer", "RFA1")
    assert chosen(*names).names == names
