import csv
import io

from annotations.events import AcceptProposal, FlagRange, Proposal
from annotations.ranges_csv import ranges_csv

FEET = ("calcn_r", "calcn_l")


def test_every_range_is_a_line_that_a_csv_reader_understands(log):
    log.append("walk, slow", FlagRange(5, 9, "notOverForcePlate", "calcn_r", 'said "edge", twice'), "anna")
    log.append("run", AcceptProposal(Proposal(0, 2, "missingBlip")), "ben")
    reviews = [log.review(trial, FEET) for trial in log.trials()]
    rows = list(csv.DictReader(io.StringIO(ranges_csv(reviews))))
    assert rows == [
        {
            "trial": "run", "start": "0", "end": "2", "foot": "", "reason": "missingBlip",
            "source": "accepted proposal", "author": "ben", "edit": "2", "note": "",
        },
        {
            "trial": "walk, slow", "start": "5", "end": "9", "foot": "calcn_r", "reason": "notOverForcePlate",
            "source": "person", "author": "anna", "edit": "1", "note": 'said "edge", twice',
        },
    ]  # fmt: skip


def test_nothing_flagged_is_the_head_alone(log):
    assert ranges_csv([log.review("walk", FEET)]) == "trial,start,end,foot,reason,source,author,edit,note\n"
