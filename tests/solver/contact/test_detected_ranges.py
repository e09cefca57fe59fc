import numpy as np

from annotations.reasons import REASONS
from solver.contact import detected_ranges
from solver.contact.detected_ranges import Proposal, within


def test_every_reason_is_a_word_of_the_b3d_format():
    words = [value for name, value in vars(detected_ranges).items() if name.isupper()]
    assert len(words) >= 10
    assert set(words) <= set(REASONS)


def test_what_is_cut_to_used_frames_may_fall_apart_or_vanish():
    used = np.array([0, 1, 1, 0, 1, 1, 1, 0], dtype=bool)
    found = [Proposal((2, 6), "calcn_r", "forceDiscrepancy", 0.9), Proposal((7, 8), None, "missingBlip", 0.8)]
    cut = within(found, used)
    assert [p.range for p in cut] == [(2, 3), (4, 6)]
    assert {(p.foot, p.reason, p.confidence) for p in cut} == {("calcn_r", "forceDiscrepancy", 0.9)}
