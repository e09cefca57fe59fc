"""Events that come and go when a threshold changes."""

from benchmarks.gait_settings import _others


def test_an_event_that_hardly_moves_is_the_same_and_others_go_and_come():
    usual = [(0, "contact", 1.0), (0, "foot-off", 1.6), (1, "contact", 1.5)]
    told = [(0, "contact", 1.001), (0, "foot-off", 1.62), (1, "contact", 1.5), (1, "contact", 2.0)]
    assert _others(told, usual) == 2  # one that moved, one that came
    assert _others(usual, told) == 1
    assert _others(usual, usual) == 0
