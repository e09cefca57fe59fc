import json

import numpy as np
import pytest

from annotations.events import ClearRange, FlagRange, ImportLabels, SetStatus, Status
from annotations.review_errors import ReviewError
from annotations.review_json import export_labels, import_labels

FEET = ("calcn_r", "calcn_l")
LABELS = np.array([True, True, False, False, True, False])


def test_labels_come_in_as_the_reviewer_imported(log):
    number = import_labels(log, "walk", LABELS, finished=True)
    (edit,) = log.history("walk")
    assert (edit.number, edit.author) == (number, "imported")
    assert edit.event == ImportLabels(((0, 2), (4, 5)), 6, True)
    review = log.review("walk", FEET)
    np.testing.assert_array_equal(review.missing(6), np.stack([LABELS, LABELS], axis=1))
    assert review.status is Status.FINISHED


def test_the_same_labels_are_not_imported_twice_even_when_undone(log):
    import_labels(log, "walk", LABELS, finished=False)
    assert import_labels(log, "walk", LABELS, finished=False) is None
    assert import_labels(log, "walk", ~LABELS, finished=False) is not None
    assert len(log.history()) == 2


def test_a_review_goes_out_in_the_form_it_came_in(log, tmp_path):
    import_labels(log, "walk", LABELS, finished=True)
    written = export_labels(log.review("walk", FEET), 6, tmp_path)
    segment = tmp_path / "walk" / "segment_1"
    assert written == [segment / "review.json", segment / "REVIEWED"]
    assert json.loads(written[0].read_text()) == {"missing_grf_data": LABELS.tolist()}
    assert written[1].read_bytes() == b""


def test_a_frame_is_missing_as_soon_as_one_foots_force_is(log, tmp_path):
    log.append("walk", FlagRange(1, 3, "manualReview", "calcn_r"), "anna")
    log.append("walk", FlagRange(2, 4, "manualReview", "calcn_l"), "anna")
    (written,) = export_labels(log.review("walk", FEET), 5, tmp_path)
    assert json.loads(written.read_text())["missing_grf_data"] == [False, True, True, True, False]


def test_reviewed_says_that_a_person_finished_not_that_somebody_began(log, tmp_path):
    log.append("walk", ClearRange(0, 3), "anna")
    assert len(export_labels(log.review("walk", FEET), 5, tmp_path / "a")) == 1
    log.append("walk", SetStatus(Status.FINISHED), "anna")
    assert len(export_labels(log.review("walk", FEET), 5, tmp_path / "b")) == 2


def test_a_review_that_is_there_stays_as_it_is(log, tmp_path):
    there = tmp_path / "walk" / "segment_1" / "review.json"
    there.parent.mkdir(parents=True)
    there.write_text("mine")
    with pytest.raises(ReviewError, match=r"review\.json: exists already"):
        export_labels(log.review("walk", FEET), 5, tmp_path)
    assert there.read_text() == "mine"


def test_a_trials_name_does_not_lead_out_of_the_folder(log, tmp_path):
    (written,) = export_labels(log.review("../../walk", FEET), 5, tmp_path / "out")
    assert written.is_relative_to(tmp_path / "out")
    assert written.parent.parent.parent == tmp_path / "out"
    assert ".." not in written.parts
