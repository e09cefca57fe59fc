import pytest

from annotations.reasons import REASON_KEYS, REASONS, checked_reason, reason_named, reason_words
from annotations.review_errors import ReviewError


def test_keys_one_to_nine_stand_for_reasons_of_the_list():
    assert [key.key for key in REASON_KEYS] == list("123456789")
    for key in REASON_KEYS:
        checked_reason(key.reason)


@pytest.mark.parametrize(
    "text",
    [
        "notOverForcePlate",
        "notoverforceplate",
        " NotOverForcePlate ",
        "1",
        "not over a plate",
        "Not over  a plate",
    ],
)
def test_a_reason_by_its_name_its_key_or_the_keys_words(text):
    assert reason_named(text) == "notOverForcePlate"


def test_every_reason_has_words_of_its_own_that_name_it():
    words = [reason_words(reason) for reason in REASONS[1:]]
    assert len(set(words)) == len(words)
    assert not set(words) & set(REASONS)
    assert [reason_named(said) for said in words] == list(REASONS[1:])
    assert reason_words("some detector's own") == "some detector's own"


@pytest.mark.parametrize(
    ("text", "nearest"),
    [
        ("notOverPlate", "notOverForcePlate"),
        ("clipped", "interpolatedClippedGRF"),
        ("cop", "copOutsideConvexFootError"),
        ("?", "manualReview"),
        ("", "notOverForcePlate"),
    ],
)
def test_an_unknown_reason_is_refused_with_the_nearest(text, nearest):
    with pytest.raises(ReviewError, match=rf"no reason '.*'; nearest: .*{nearest}"):
        reason_named(text)


@pytest.mark.parametrize("check", [reason_named, checked_reason])
def test_that_the_force_counts_is_no_reason_to_leave_it_out(check):
    with pytest.raises(ReviewError, match="clear the range instead"):
        check("notMissingGRF")
