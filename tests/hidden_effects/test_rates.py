import pytest

from benchmarks.diagnosis.rates import smallest_found, table, wilson


def test_wilsons_interval_against_the_quadratic_it_solves():
    """Its ends are the rates p for which (p̂ − p)² = z² p (1 − p) / n."""
    for hits, count in ((0, 150), (3, 150), (95, 100), (28.5, 30)):
        for end in wilson(hits, count):
            p = hits / count
            assert (p - end) ** 2 == pytest.approx(1.959964**2 * end * (1 - end) / count, abs=1e-12)


def test_two_percent_need_about_a_hundred_and_fifty_clean_recordings_without_an_alarm():
    assert wilson(0, 150)[1] == pytest.approx(0.025, abs=0.001)


def test_the_smallest_size_found_is_found_at_all_larger_ones():
    sizes = [0.5] * 4 + [1.0] * 4 + [1.5] * 4
    assert smallest_found(sizes, [0, 1, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1]) == 1.0
    assert smallest_found(sizes, [1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1]) == 1.5
    assert smallest_found(sizes, [1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 1, 1]) is None


def test_a_table_is_markdown():
    assert table(["a", "b"], [[1, "x"]]) == "| a | b |\n|---|---|\n| 1 | x |"
