from annotations.foot_names import foot_letter, foot_words, next_foot

FEET = ("calcn_r", "calcn_l")


def test_feet_go_by_their_side_and_others_by_their_name():
    assert [foot_letter(f) for f in (*FEET, "RightFoot", "hoof")] == ["R", "L", "R", "hoof"]
    assert [foot_words(f) for f in (*FEET, None, "hoof")] == ["right", "left", "both", "hoof"]


def test_one_key_walks_through_right_left_and_both():
    walk = [None]
    for _ in range(3):
        walk.append(next_foot(walk[-1], FEET[::-1]))
    assert walk == [None, "calcn_r", "calcn_l", None]
    assert next_foot("gone", FEET) is None
