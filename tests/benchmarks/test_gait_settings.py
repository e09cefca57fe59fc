"""Events that come and go when a threshold changes, and errors of what is read of a belt."""

import json
from dataclasses import dataclass

import numpy as np
import pytest

from benchmarks.activities.puppets import earlier, puppet, steps
from benchmarks.activities.simulated import FEET
from benchmarks.gait_belts import belt_answer
from benchmarks.gait_events import Told
from benchmarks.gait_hidden import hide
from benchmarks.gait_known_cycles import cycles_of_plants, unmatched
from benchmarks.gait_over_plates import _plates, verdict_on
from benchmarks.gait_settings import BELTS, CYCLES, HIDDEN, PLATES, _others, of_events, of_settings, usual_for
from solver.gait.settings import GAIT
from solver.gravity import GRAVITY


def test_an_event_that_hardly_moves_is_the_same_and_others_go_and_come():
    usual = [(0, "contact", 1.0), (0, "foot-off", 1.6), (1, "contact", 1.5)]
    told = [(0, "contact", 1.001), (0, "foot-off", 1.62), (1, "contact", 1.5), (1, "contact", 2.0)]
    assert _others(told, usual) == 2  # one that moved, one that came
    assert _others(usual, told) == 1
    assert _others(usual, usual) == 0


def test_events_that_come_back_from_another_process_are_the_same():
    usual = [[(0, "contact", 1.0), (0, "foot-off", 1.6)]]
    told = of_events("x.py Y", 2.0, [("one", 0.2)], json.loads(json.dumps(usual)), usual)
    assert (told.wrong, told.changed, told.of) == (0.2, 0.0, 2)


@dataclass
class Walk:
    """Whose errors are what a setting is beyond another."""

    person: str
    off: float

    def errors(self, settings):
        return [self.off + (settings.flat_to - GAIT.flat_to), -self.off]


def test_errors_on_belts_count_a_person_once():
    (usual, _, after) = (one for one in of_settings(BELTS) if one[0] in ("Belts", "GaitSettings.flat_to"))
    walks = [Walk("one", 0.01), Walk("one", 0.03), Walk("two", 0.04)]
    told = belt_answer(walks, GAIT, usual)
    assert (told.wrong, told.changed, told.of) == (pytest.approx(0.03), 0.0, 6)
    assert told.by_person == {"one": pytest.approx(0.01), "two": pytest.approx(0.02)}
    later = belt_answer(walks, GAIT, after)
    assert later.changed == 0.5
    assert later.by_person["two"] == pytest.approx((0.04 + (1 - GAIT.flat_to) / 2 + 0.04) / 2 / 2)


def test_only_what_is_read_of_a_belt_is_asked_there():
    assert {name for name, *_ in of_settings(BELTS)} == {
        BELTS, "GaitSettings.flat_from", "GaitSettings.flat_to", "GaitSettings.belt_window_s",
    }  # fmt: skip


def test_every_setting_and_number_is_compared_with_its_own_people():
    assert usual_for("GaitSettings.gap_s") == usual_for("gait/events.py SAME_STANCE_S") == PLATES
    assert usual_for("GaitSettings.longest_cycle_s") == CYCLES
    assert usual_for("gait/gait.py BRIDGED_S") == HIDDEN
    assert usual_for("GaitSettings.low_m") == "GaitSettings"


def test_a_row_of_plates_bears_the_weight_of_who_walks_over_it(monkeypatch):
    monkeypatch.setattr("benchmarks.gait_over_plates.ASIDE_M", (1.0, 1.0))  # both feet amid the plates
    monkeypatch.setattr("benchmarks.gait_over_plates.PLATE_M", (0.9, 0.9))
    who = puppet(7)
    plants = earlier(steps([(0.6, 0.0)] * 12, 0.5), 1.0)
    plates = list(_plates(who, plants, 5.0, np.random.default_rng(1), [0.1, -0.1]))
    stride = (plates[0].times > 1.5) & (plates[0].times < 2.5)  # amid the row, whoever steps on the seams
    total = sum(plate.force_ground[stride, 1] for plate in plates)
    assert total.mean() == pytest.approx(who.skeleton.mass * GRAVITY, rel=0.03)
    centre = np.concatenate([plate.cop_ground[np.isfinite(plate.cop_ground[:, 2]), 2] for plate in plates])
    assert np.abs(centre).max() <= 0.1 + 1e-9


def test_events_beyond_the_ends_are_neither_missed_nor_extra():
    truth = [Told("r", "contact", 0.01), Told("r", "contact", 1.0), Told("r", "contact", 2.0)]
    told = [Told("r", "contact", 0.05), Told("r", "contact", 1.01), Told("l", "contact", 1.5)]
    verdict = verdict_on(truth, told, 3.0)
    assert verdict.errors["contact"] == [pytest.approx(0.01)]
    assert [len(verdict.missed), len(verdict.extra)] == [1, 1]


def test_a_cycle_in_which_somebody_halts_does_not_count():
    plants = earlier(steps([(0.5, 0.0)] * 9, 0.6, waits_s={5: 2.0}), 0.9)
    known = cycles_of_plants(plants, 7.0, 2.0)
    assert known
    assert all(end - begin == pytest.approx(1.2) for _, begin, end in known)
    longer = (0, known[0][1], known[0][2] + 2.0)
    assert unmatched([*known, longer], known) == 1
    assert unmatched(known, known[1:]) == 1


def test_only_a_foot_s_own_markers_are_hidden_and_only_near_there_anything_is_asked():
    skeleton = puppet(7).skeleton
    observed = np.zeros((400, len(skeleton.markers), 3))
    left, near = hide(skeleton, FEET, observed, 100.0, np.random.default_rng(2))
    bodies = [skeleton.bodies[marker.body].name for marker in skeleton.markers]
    for foot, side in enumerate("rl"):
        own = [name in (f"calcn_{side}", f"toes_{side}") for name in bodies]
        gone = np.isnan(left[:, own, 0]).any(axis=1)
        assert gone.any()
        assert near[gone, foot].all()
        assert not near[:, foot].all()
    others = [not name.startswith(("calcn", "toes")) for name in bodies]
    assert np.isfinite(left[:, others]).all()
