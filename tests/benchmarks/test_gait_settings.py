"""Events that come and go when a threshold changes, and errors of what is read of a belt."""

from dataclasses import dataclass

import pytest

from benchmarks.gait_belts import belt_answer
from benchmarks.gait_settings import _others, is_of_belts, of_belts
from solver.gait.settings import GAIT


def test_an_event_that_hardly_moves_is_the_same_and_others_go_and_come():
    usual = [(0, "contact", 1.0), (0, "foot-off", 1.6), (1, "contact", 1.5)]
    told = [(0, "contact", 1.001), (0, "foot-off", 1.62), (1, "contact", 1.5), (1, "contact", 2.0)]
    assert _others(told, usual) == 2  # one that moved, one that came
    assert _others(usual, told) == 1
    assert _others(usual, usual) == 0


@dataclass
class Walk:
    """Whose errors are what a setting is beyond another."""

    person: str
    off: float

    def errors(self, settings):
        return [self.off + (settings.flat_to - GAIT.flat_to), -self.off]


def test_errors_on_belts_count_a_person_once():
    (usual, _, after) = (one for one in of_belts() if one[0] in ("Belts", "GaitSettings.flat_to"))
    walks = [Walk("one", 0.01), Walk("one", 0.03), Walk("two", 0.04)]
    told = belt_answer(walks, GAIT, usual)
    assert (told.wrong, told.changed, told.of) == (pytest.approx(0.03), 0.0, 6)
    assert told.by_person == {"one": pytest.approx(0.01), "two": pytest.approx(0.02)}
    later = belt_answer(walks, GAIT, after)
    assert later.changed == 0.5
    assert later.by_person["two"] == pytest.approx((0.04 + (1 - GAIT.flat_to) / 2 + 0.04) / 2 / 2)


def test_only_what_is_read_of_a_belt_is_asked_there():
    assert {name for name, *_ in of_belts() if is_of_belts(name)} == {
        "GaitSettings.flat_from", "GaitSettings.flat_to", "GaitSettings.belt_window_s",
    }  # fmt: skip
