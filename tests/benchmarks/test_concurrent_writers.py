"""Two programs that change one results folder at once: nothing that was reported is lost."""

from itertools import product

import pytest

from benchmarks.concurrent_writers import KINDS, RECORDING, faults_of_fits, faults_of_pair


@pytest.mark.parametrize(
    ("seed", "kinds"), list(enumerate([*product(KINDS, repeat=2), ("fit", "fit")], start=1))
)
def test_no_result_is_lost_and_no_success_is_false(small_fit, seed, kinds):
    assert faults_of_pair(small_fit, kinds, seed) == []


@pytest.mark.slow
@pytest.mark.real
def test_two_terminals_fit_one_real_recording_at_once(real_data):
    assert faults_of_fits(real_data / RECORDING) == []
