"""The flagged ranges of a subject as CSV, for a spreadsheet or a statistics program."""

import csv
from collections.abc import Iterable
from io import StringIO

from annotations.trial_review import TrialReview

COLUMNS = ("trial", "start", "end", "foot", "reason", "source", "author", "edit", "note")


def ranges_csv(reviews: Iterable[TrialReview]) -> str:
    """One line a range; frames from `start` to `end` − 1, `foot` empty where all feet are meant."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for review in reviews:
        writer.writerows(
            (review.trial, f.start, f.end, f.foot or "", f.reason, f.source.value, f.author, f.edit, f.note)
            for f in review.flags
        )
    return text.getvalue()
