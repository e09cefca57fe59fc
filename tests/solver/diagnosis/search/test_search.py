"""In what order causes are found, exchanged and taken back."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateBias, PlateGain
from solver.diagnosis.search import search
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import EXCHANGE_NATS, LEAST_FURTHER_NATS, handicap
from solver.diagnosis.search.selection import select
from solver.fitting.diagnosis_settings import DiagnosisSettings
from tests.solver.diagnosis.conftest import trial_rows_of
from tests.solver.diagnosis.named_causes import (
    Bounded,
    Limb,
    RareSwing,
    SeenElsewhere,
    SmallSwing,
    Swing,
    TimeHistory,
    named,
    swung,
)

SETTINGS = DiagnosisSettings()


def test_a_later_cause_makes_room_for_a_better_first_one(short_scene, drawn, balance_of_scenes):
    """Whatever the order of discovery, no exchange of one cause for another would gain any more."""
    loads = short_scene.plates[0].wrench_ground
    moved = np.zeros_like(loads)
    moved[:, 3:] = np.cross([0.03, 0, 0.02], loads[:, :3])
    catalogue = [
        *[PlateGain(plate.target) for plate in short_scene.plates],
        *PlateBias.candidates([short_scene]),
        *PlatePosition.candidates([short_scene]),
        ClockOffset("all"),
    ]
    balance = balance_of_scenes(drawn(4, 0.12 * short_scene.plates[1].wrench_ground + moved, scale=0.5))
    selection = select(balance, catalogue)
    terms = [f.contender.term for f in selection.found]
    assert len(terms) >= 2
    for k in range(len(terms)):
        rest = terms[:k] + terms[k + 1 :]
        for candidate in catalogue:
            if candidate.key in {t.candidate.key for t in terms} or candidate.starts(balance.scenes) != ((),):
                continue
            other = balance.solve([*rest, balance.term(candidate, ())], near=selection.solved.noise_scale)
            least = EXCHANGE_NATS + handicap(candidate, SETTINGS)
            own = handicap(terms[k].candidate, SETTINGS)
            assert other.log_evidence - least < selection.solved.log_evidence - own + 1e-6


def test_a_search_that_had_its_evaluations_ends_with_what_held_up_so_far(short_scene, drawn):
    """Two causes, found one after the other: as many evaluations always lead equally far."""
    one, other = 0.15 * short_scene.plates[1].wrench_ground, np.zeros((short_scene.frames, 6))
    other[:, 0] = 60.0
    other[:, 3:] = np.cross(short_scene.com_ground, other[:, :3])
    causes = [TimeHistory("one", one), TimeHistory("other", other)]
    rows = trial_rows_of(drawn(4, one + other, scale=0.3))

    def found(most_evaluations):
        settings = replace(SETTINGS, most_evaluations=most_evaluations)
        balance = Balance([rows], settings)
        selection = select(balance, causes)
        return named(selection), selection.ended_early, balance.evaluations

    whole, early, needed = found(SETTINGS.most_evaluations)
    assert (set(whole), early) == ({c.key for c in causes}, False)
    lengths = []
    for share in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5):
        some, early, spent = found(share * needed)
        assert early
        assert some == whole[: len(some)]
        assert spent < needed
        assert found(share * needed) == (some, early, spent)
        lengths.append(len(some))
    assert lengths == sorted(lengths)
    assert {0, 1} <= set(lengths)


def test_two_that_stand_out_only_together_are_named(short_scene, drawn, monkeypatch):
    """What two causes have in common cancels: each alone explains next to nothing of what is left."""
    common = 0.3 * short_scene.plates[0].wrench_ground
    apart = np.zeros_like(common)
    apart[:, :3] = [9.0, 0.0, 0.0]
    apart[:, 3:] = np.cross(short_scene.com_ground, apart[:, :3])
    one, other = TimeHistory("one", apart + common), TimeHistory("other", apart - common)
    scene = drawn(4, 2 * apart, scale=0.3)
    monkeypatch.setattr(search, "LEAST_OF_TWO_NATS", -10.0)
    balance = Balance([trial_rows_of(scene)], SETTINGS)
    nothing = balance.solve([]).log_evidence
    for alone in (one, other):
        assert balance.solve([balance.term(alone, ())]).log_evidence - nothing < SETTINGS.least_gain
        assert named(select(balance, [alone])) == []
    selection = select(balance, [one, other])
    assert set(named(selection)) == {one.key, other.key}
    assert selection.solved.log_evidence - nothing > SETTINGS.least_gain + LEAST_FURTHER_NATS
    monkeypatch.setattr(search, "TRIED_IN_PAIRS", 0)
    assert named(select(balance, [one, other])) == []


def test_what_is_known_from_elsewhere_does_not_end_the_search(short_scene, drawn):
    """It hardly helps the balance, in which something else is wrong as well."""
    small = np.zeros((short_scene.frames, 6))
    small[:, 0] = 3.0
    small[:, 3:] = np.cross(short_scene.com_ground, small[:, :3])
    large = 0.15 * short_scene.plates[1].wrench_ground
    known, other = SeenElsewhere("known", small), TimeHistory("other", large)
    balance = Balance([trial_rows_of(drawn(4, small + large, scale=0.3))], SETTINGS)
    nothing = balance.solve([]).log_evidence
    assert balance.solve([balance.term(known, ())]).log_evidence < nothing + SETTINGS.least_gain
    assert named(select(balance, [known, other])) == [known.key, other.key]


def test_nothing_is_lost_by_a_cause_that_is_taken_back_with_the_one_it_made_needless(short_scene, drawn):
    """Beside the first a limb is small enough; without it, no longer."""
    common = 0.3 * short_scene.plates[0].wrench_ground
    apart = np.zeros_like(common)
    apart[:, :3] = [8.0, 0.0, 0.0]
    apart[:, 3:] = np.cross(short_scene.com_ground, apart[:, :3])
    whole, limb = TimeHistory("whole", common), Limb("limb", common + apart)
    balance = Balance([trial_rows_of(drawn(4, common + apart, scale=0.3))], SETTINGS)
    alone, both = ([balance.term(c, ()) for c in some] for some in ([limb], [whole, limb]))
    sizes = [
        balance.solve(terms).estimates(len(terms) - 1, balance.scenes)["size"].value
        for terms in (alone, both)
    ]
    assert abs(sizes[1]) < 0.9 < abs(sizes[0])
    assert named(select(balance, [whole, limb])) == [whole.key]


def test_no_cause_takes_the_place_of_one_by_making_another_too_small(short_scene, drawn):
    """It shares what the other explains, and leaves of that what nobody would act on."""
    one, other = (np.zeros((short_scene.frames, 6)) for _ in range(2))
    one[:, 0], other[:, 2] = 60.0, 60.0
    for wrench in (one, other):
        wrench[:, 3:] = np.cross(short_scene.com_ground, wrench[:, :3])
    first = Bounded("first", one, 0.0, 2.0)
    second = Bounded("second", other, 0.25, 0.9, 0.1)
    both = Bounded("both", one + 0.3 * other, 0.0, 1.03)
    balance = Balance([trial_rows_of(drawn(4, one + 0.5 * other, scale=0.3))], SETTINGS)

    def solved(*some):
        solved = balance.solve([balance.term(c, ()) for c in some])
        sizes = [solved.estimates(k, balance.scenes)["size"].value for k in range(len(some))]
        return solved.log_evidence, sizes

    assert solved(both, second)[0] > solved(first, second)[0] + EXCHANGE_NATS
    assert not second.least < solved(both, second)[1][1]
    assert named(select(balance, [first, second, both])) == [first.key, second.key]


def test_what_two_causes_do_together_is_not_left_to_a_third_that_resembles_both(short_scene, drawn):
    """The third is found first; beside either of the two it is too small, and either alone is less likely."""
    one, other, beside = (np.zeros((short_scene.frames, 6)) for _ in range(3))
    one[:, 0], other[:, 2], beside[:, 2] = 60.0, 55.0, 40.0 * np.sin(20 * short_scene.times)
    for wrench in (one, other, beside):
        wrench[:, 3:] = np.cross(short_scene.com_ground, wrench[:, :3])
    first, second = Bounded("first", one, 0.2, 2.0), Bounded("second", other, 0.2, 2.0)
    mixed = Bounded("mixed", one + other + beside, 0.6, 2.0)
    balance = Balance([trial_rows_of(drawn(4, one + other, scale=0.3))], SETTINGS)

    def solved(*some):
        solved = balance.solve([balance.term(c, ()) for c in some])
        return solved.log_evidence, solved.estimates(0, balance.scenes)["size"].value

    assert solved(mixed)[0] > max(solved(first)[0], solved(second)[0])
    assert solved(mixed)[1] > mixed.least > max(solved(mixed, c)[1] for c in (first, second))
    assert set(named(select(balance, [first, second, mixed]))) == {first.key, second.key}


@pytest.mark.parametrize(("lead", "first"), [(10.0, "seen_gain"), (0.0, "plate_gain")])
def test_what_is_seen_without_forces_is_tried_before_its_equals(short_scene, drawn, lead, first, monkeypatch):
    """The same trace at odds of 5 nats: as a foot that stands where no plate is, beside a harness."""

    @dataclass(frozen=True)
    class SeenGain(PlateGain):
        id = "seen_gain"
        about = About("seen_gain", seen_standing=True)

    rows = trial_rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    monkeypatch.setattr(search, "SEEN_STANDING_NATS", lead)
    settings = replace(SETTINGS, handicaps=(("seen_gain", 5.0),), least_confidence=0.0)
    found = select(Balance([rows], settings), [PlateGain("plate_2"), SeenGain("plate_2")]).found
    assert [f.contender.term.candidate.id for f in found] == [first]


def test_of_causes_that_do_nearly_as_well_the_one_stays_beside_which_others_show(
    short_scene, drawn, balance_of_scenes, monkeypatch
):
    """A usual cause that says most of it hides a small one; a rare one that says all of it does not."""
    true, imitation = RareSwing("all", rates=((20.0, 1.0),)), Swing("all", rates=((20.0, 0.9), (33.0, 0.45)))
    small = SmallSwing("all", rates=((9.0, 1.0),))
    wrong = swung(short_scene, ((20.0, 0.25), (9.0, 0.04)))
    balance = balance_of_scenes(drawn(3, wrong, scale=0.3))
    alone = [balance.solve([balance.term(one, ())]).log_evidence for one in (true, imitation)]
    against = alone[0] - alone[1] + 2.0
    assert against > 0

    def found(most_starts):
        monkeypatch.setattr(search, "MOST_STARTS", most_starts)
        settings = replace(SETTINGS, handicaps=(("rare_swing", against),))
        return set(named(select(Balance(balance.trials, settings), [true, imitation, small])))

    assert found(0) == {imitation.key}
    assert found(2) == {true.key, small.key}
