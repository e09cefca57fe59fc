"""The section on a release's costs, from figures that are made up."""

import pytest

from benchmarks.release_cost import SHARES, WHOLE_FRAMES, Build, section
from benchmarks.release_kills import Kill, Kills

LENGTHS = [
    Build("length", n, 1, n, 1, 10.0, cpu, 400.0, 3.0) for n, cpu in ((120, 6.0), (500, 10.0), (2000, 20.0))
]
TRIALS = [
    Build("trials", 25, 1, 3000, 5, 100.0, 90.0, 500.0, 2.0),
    Build("trials", 25, 2, 3000, 5, 60.0, 99.0, 520.0, 2.5),
    Build("trials", 100, 1, 12000, 20, 400.0, 351.0, 500.0, 2.0),
]


def test_shares_of_lengths_are_of_all_frames():
    assert sum(SHARES.values()) == pytest.approx(1.0)


def test_projection_is_the_weighted_cost_a_frame():
    """By hand: 0.05, 0.02 and 0.01 s a frame; beyond the longest as at 2000."""
    hours = 24e6 * (0.10 * 0.05 + 0.45 * 0.02 + 0.35 * 0.01 + 0.10 * 0.01) / 3600
    assert WHOLE_FRAMES == 24e6
    assert f"built: {hours:.0f} core hours" in section([*TRIALS, *LENGTHS])
    diagnosed = Build("diagnosis", 500, 1, 500, 1, 40.0, 30.0, 600.0, 3.0)
    told = section([*TRIALS, *LENGTHS, diagnosed])
    both = 24e6 * (10 + 30) / 500 / 3600
    assert f"built and diagnosed, the fit counted twice: {both:.0f} core hours" in told


def test_what_is_linear_and_what_a_second_worker_saves():
    told = section([*TRIALS, *LENGTHS])
    assert "CPU time: 3.90 times from 25 to 100 trials.\n" in told
    assert "The second worker saves on the clock: 40 % with 25 trials (+10 % CPU).\n" in told
    assert "The largest worker held 520 MB" in told
    assert "400 trials were not built with 1 worker." in told
    assert "25 trials were not built" not in told
    assert "No diagnosis was measured" in told


def test_killed_builds_are_told_by_victim_and_what_differs_is_not_hidden():
    kills = tuple(Kill(("worker", "client")[k % 2], float(k), k < 9, True) for k in range(10))
    right = Kills(3, 40, 20.0, 1, kills, True, 1, True)
    told = section([], right)
    assert (
        "worker killed (signal 9) in 5 builds, after 0.0, 2.0, 4.0, 6.0, 8.0 s; 5 ended in the same" in told
    )
    assert "client killed (signal 9) in 4 builds" in told
    assert "2 workers at a time: the same release." in told
    assert "9 of 10 builds were killed." in told
    assert "differ as told above" not in told
    assert "were not compared" not in told
    assert "No subject was changed" not in told
    few = section([], Kills(3, 40, 20.0, 1, kills[:2]))
    assert "were not compared" in few
    assert "No subject was changed" in few
    for wrong in (
        Kills(3, 40, 20.0, 1, (Kill("worker", 1.0, True, False),)),
        Kills(3, 40, 20.0, 1, kills, False),
        Kills(3, 40, 20.0, 1, kills, True, 2, True),
        Kills(3, 40, 20.0, 1, kills, True, 1, False),
    ):
        assert "differ as told above" in section([], wrong)
