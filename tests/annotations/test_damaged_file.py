"""A byte of the review log's file is another: every edit is accounted for, or people are told what to do."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from annotations.events import IMPORTED, ClearRange, FlagRange, ImportTable, SetStatus, Status
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError
from annotations.work import LONGEST_NAME, Assign, Comment

EDITS = 25


@pytest.fixture
def whole(tmp_path) -> bytes:
    path = tmp_path / "whole.sqlite"
    with ReviewLog.open(path) as log:
        for k in range(EDITS):
            log.append("walk", FlagRange(k, k + 2, "forceDiscrepancy", note=k * "x"), "anna")
        log.work.append(["walk"], Comment("look", 2), "ben")
    return path.read_bytes()


@given(share=st.floats(0, 1), byte=st.integers(0, 255), at_the_head=st.booleans())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_edit_is_lost_in_silence(whole, tmp_path, share, byte, at_the_head):
    data, path = bytearray(whole), tmp_path / "damaged.sqlite"
    data[int(share * (4095 if at_the_head else len(data) - 1))] = byte
    path.write_bytes(data)
    try:
        with ReviewLog.open(path, patience_s=1.0) as log:
            found = log.reading()
            log.work.reading()
    except ReviewError as error:
        said = str(error)
        assert said.startswith(f"{path}: ")
        assert "\n" not in said
    else:
        assert len(found.edits) + len(found.unreadable) == EDITS


def test_a_damaged_file_says_what_to_do(whole, tmp_path):
    path = tmp_path / "damaged.sqlite"
    path.write_bytes(whole[:4096] + b"\xff" * 4096 + whole[8192:])
    with pytest.raises(ReviewError, match=r"damaged\.sqlite: the review log is damaged .*--ignore-review"):
        ReviewLog.open(path)


AUTHORS = ["x" * 9999, "x" * (LONGEST_NAME + 1), "an\0na", "an\nna", "anna \ud800", "\udce4"]
WORDS = ["a\0b", "half \ud83e of a pair"]


@pytest.mark.parametrize("author", AUTHORS)
@pytest.mark.parametrize("event", [FlagRange(1, 2, "forceDiscrepancy"), Assign("ben"), Comment("look")])
def test_an_author_who_cannot_be_shown_is_refused(log, author, event):
    to, trial = (log, "walk") if isinstance(event, FlagRange) else (log.work, ["walk"])
    with pytest.raises(ReviewError, match="name has at most"):
        to.append(trial, event, author)
    assert (log.revision(), log.work.revision()) == (0, 0)


@pytest.mark.parametrize("words", WORDS)
@pytest.mark.parametrize(
    "said",
    [
        lambda words: FlagRange(1, 2, "forceDiscrepancy", note=words),
        lambda words: SetStatus(Status.FINISHED, words),
        lambda words: ImportTable("t.csv", words, (ClearRange(1, 2, note=words),)),
        Comment,
    ],
)
def test_words_that_cannot_be_kept_are_refused(log, words, said):
    event = said(words)
    to, trial = (log.work, ["walk"]) if isinstance(event, Comment) else (log, "walk")
    with pytest.raises(ReviewError, match="has a character that is none"):
        to.append(trial, event, IMPORTED if isinstance(event, ImportTable) else "anna")
    assert (log.revision(), log.work.revision()) == (0, 0)
