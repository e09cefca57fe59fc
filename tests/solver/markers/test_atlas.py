import numpy as np
import pytest

from solver.markers.atlas import atlas, landmark_marker, place_on
from solver.markers.label_families import families
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions


@pytest.fixture(scope="module")
def body():
    return default_skeleton(height_m=1.6, sex="female")


def test_every_landmark_is_on_a_body_of_the_default_skeleton_and_says_what_it_is(body):
    for name, mark in atlas().items():
        assert mark.body in body.body_names, name
        assert (mark.at is None) != (mark.place is None), name
        assert len(mark.says) > 3
        assert mark.at is None or mark.at in body.marker_names


def test_left_landmarks_mirror_the_right_ones_in_the_default_pose(body):
    names = [n[:-2] for n in atlas() if n.endswith("_r")]
    skeleton = body.with_markers(
        [landmark_marker(atlas()[f"{n}_{s}"], f"{n}_{s}", body) for n in names for s in "rl"]
    )
    x = marker_positions(skeleton, body.default_q[None])[0].reshape(-1, 2, 3)
    np.testing.assert_allclose(x[:, 1], x[:, 0] * (1, 1, -1), atol=1e-9)


def test_right_landmarks_lie_on_the_right(body):
    marks = [m for m in atlas().values() if m.side == "r"]
    skeleton = body.with_markers([landmark_marker(m, m.name, body) for m in marks])
    x = marker_positions(skeleton, body.default_q[None])[0]
    assert (x[:, 2] > 0).all()


def test_places_grow_with_the_person():
    small, tall = default_skeleton(height_m=1.5), default_skeleton(height_m=1.8)
    mark = atlas()["fibula_head_r"]
    np.testing.assert_allclose(place_on(mark, tall), 1.2 * place_on(mark, small), rtol=1e-9)


def test_landmarks_stand_from_head_to_toe_in_the_order_of_anatomy(body):
    downwards = [
        "head_top",
        "c7",
        "t2",
        "t8",
        "t10",
        "t12",
        "l1",
        "l3",
        "l5",
        "sacrum",
        "trochanter_r",
        "thigh_wand_r",
    ]
    downwards += ["knee_lateral_r", "fibula_head_r", "shank_wand_r", "ankle_lateral_r", "mt5_head_r"]
    skeleton = body.with_markers([landmark_marker(atlas()[n], n, body) for n in downwards])
    heights = marker_positions(skeleton, body.default_q[None])[0][:, 1]
    assert (np.diff(heights) < 0).all()


def test_tables_of_labels_name_landmarks_that_exist():
    known = set(atlas()) | {name[:-2] for name in atlas() if name[-2:] in ("_r", "_l")}
    for family in families().values():
        assert family.source
        for meanings in (*family.paired.values(), *family.middle.values()):
            assert set(meanings) <= known, family.id
