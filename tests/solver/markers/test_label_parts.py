import pytest

from solver.markers.label_parts import plain, readings, sides, spelling, without_common_start


@pytest.mark.parametrize(
    "label",
    [
        "RASIS",
        "R.ASIS",
        "r_asis",
        "ASIS_r",
        "asis.R",
        "right_asis",
        "RightASIS",
        "RxAsis",
        "Subject01:RASIS",
        "ASIS right",
    ],
)
def test_the_usual_ways_to_name_a_side(label):
    assert ("r", "asis") in {(r.side, r.key) for r in readings(label) if r.ease >= 0.9}


def test_a_side_in_the_middle_and_digits_at_the_end():
    assert ("l", "waistfront") in {(r.side, r.key) for r in readings("WaistLFront")}
    assert ("l", "thi2") in {(r.side, r.key) for r in readings("LTHI2")}


def test_a_label_is_also_read_whole():
    assert (None, "lmal") in {(r.side, r.key) for r in readings("LMAL")}
    assert ("l", "mal") in {(r.side, r.key) for r in readings("LMAL")}


def test_a_label_has_a_side_where_its_counterpart_is_there():
    labels = ("S1_RHEE", "S1_LHEE", "S1_r_5meta", "S1_L_5meta", "S1_LowerBack", "S1_RBAK")
    assert sides(labels) == {"S1_RHEE": "r", "S1_LHEE": "l", "S1_r_5meta": "r", "S1_L_5meta": "l"}


def test_a_repeated_name_is_read_with_doubt():
    assert max(r.ease for r in readings("RASI#2")) < 0.5


def test_a_common_start_is_taken_off_up_to_a_separator():
    assert without_common_start(("S1_RASI", "S1_RKNE", "S1_C7")) == {
        "S1_RASI": "RASI", "S1_RKNE": "RKNE", "S1_C7": "C7",
    }  # fmt: skip
    assert without_common_start(("RASI", "RKNE", "RANK"))["RASI"] == "RASI"


@pytest.mark.parametrize("start", ["L_", "L.", "Left_", "left "])
def test_a_side_that_all_share_stays(start):
    labels = tuple(start + name for name in ("Heel", "Knee_Lat", "Ankle_Lat", "Toe"))
    assert without_common_start(labels) == {label: label for label in labels}
    behind_a_subject = tuple(f"S01_{label}" for label in labels)
    assert without_common_start(behind_a_subject) == dict(zip(behind_a_subject, labels, strict=True))


def test_a_subject_called_like_a_side_is_taken_off():
    labels = ("R_RASI", "R_LASI", "R_RKNE", "R_LKNE", "R_C7")
    assert without_common_start(labels) == {label: label[2:] for label in labels}


def test_two_spellings_of_a_name_share_one():
    assert spelling("L_thigh1") & spelling("thigh1.l")
    assert not spelling("L_thigh1") & spelling("R_thigh1")


@pytest.mark.parametrize(("right", "left"), ["RL", "DG", "DI", "DE", "DS"])
@pytest.mark.parametrize("form", ["{0}{1}", "{0}_{1}", "{1}{0}", "{1}.{0}"])
def test_sides_are_the_letters_in_which_most_labels_differ(right, left, form):
    stems = ("EIAS", "KNEE", "TOE", "THI2")
    labels = {
        form.format(stem, letter): side for stem in stems for side, letter in (("r", right), ("l", left))
    }
    assert sides((*labels, "C7", "LOMBA", "DOS")) == labels


def test_letters_of_another_language_are_no_sides_where_most_are_r_and_l():
    labels = ("RTHAD", "RTHAG", "LTHAD", "LTHAG", "RKNE", "LKNE")
    assert plain(labels) == {label: label for label in labels}


def test_a_name_that_occurs_twice_has_the_side_of_the_first():
    labels = ("EIASD", "EIASG", "GENOUD", "GENOUG", "GENOUD#2")
    assert plain(labels)["GENOUD#2"].startswith("R ")


def test_the_numbers_of_a_list_are_no_names():
    labels = ("1 - Head", "2 - L_Knee", "12 - R_Knee", "13 - R_Toe_II")
    assert plain(labels) == dict(zip(labels, ("Head", "L_Knee", "R_Knee", "R_Toe_II"), strict=True))
    assert plain(("1_a", "RKNE")) == {"1_a": "1_a", "RKNE": "RKNE"}
