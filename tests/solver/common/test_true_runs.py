"""Runs of True say the same as the flags."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from solver.common.true_runs import runs


@given(st.lists(st.booleans(), max_size=50))
def test_runs_say_the_same_as_the_flags(flags):
    found = runs(np.array(flags, dtype=bool))
    rebuilt = np.zeros(len(flags), dtype=bool)
    for first, end in found:
        assert first < end
        rebuilt[first:end] = True
    assert rebuilt.tolist() == flags
    assert all(end < following for (_, end), (following, _) in pairwise(found))
