"""What passes and what falls at each check: too little gained, another body mass, the others undone."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis import checks
from solver.diagnosis.cause_decisions import Trail, tenable
from solver.diagnosis.causes.body_masses import SubjectMass
from solver.diagnosis.causes.clocks import ClockOffset, SampleRate
from solver.diagnosis.causes.effect import Nonlinear
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.off_plate_step import OffPlateStep
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.checks import (
    CHECKS,
    HELD_OUT_SHARE,
    MASS_HELD_OUT_SHARE,
    MOST_MASS_STRAIN,
    QUIET_SCALE,
    STEP_REST_SHARE,
    least_first_gain,
    loose_ends,
)
from solver.diagnosis.direct_checks.weight import Weighing, Weighings
from solver.diagnosis.held_out_gain import blocks, held_out_gain
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import LEAST_FURTHER_NATS, RIVAL_SHARE, Contender, Found
from solver.diagnosis.search.proposed_causes import Kept
from solver.diagnosis.search.selection import select
from solver.diagnosis.search.terms import Term
from solver.fitting.diagnosis_settings import DiagnosisSettings
from tests.solver.diagnosis.conftest import trial_rows_of
from tests.solver.diagnosis.named_causes import Helper, Shake, TimeHistory, named

SETTINGS = DiagnosisSettings()


def test_a_cause_that_needs_a_body_of_another_mass_is_refused(
    short_scene, drawn, balance_of_scenes, monkeypatch
):
    """What shakes the plates is there; that it comes with a body 5 % lighter the entered mass denies."""
    shaken = 0.05 * short_scene.required_ground * np.sin(20 * short_scene.times)[:, None]
    balance = balance_of_scenes(drawn(4, shaken, scale=0.3))
    helper = Helper("all")
    leaning, nothing = balance.solve([balance.term(helper, ())]), balance.solve([])
    assert leaning.log_evidence - nothing.log_evidence > SETTINGS.least_gain
    assert abs(balance.mass_strain(leaning)) > MOST_MASS_STRAIN > abs(balance.mass_strain(nothing))
    assert named(select(balance, [helper])) == []
    monkeypatch.setattr(checks, "MOST_MASS_STRAIN", 20.0)
    assert named(select(balance, [helper])) == [helper.key]


def test_a_cause_far_ahead_of_all_others_stays_though_the_mass_is_wrong_as_well(
    short_scene, drawn, balance_of_scenes
):
    """A fault that nothing else resembles, and a person of another mass than entered."""
    measured = short_scene.measured_ground
    shaken = 0.3 * measured * np.sin(20 * short_scene.times)[:, None]
    balance = balance_of_scenes(drawn(4, shaken - 0.07 * measured, scale=0.3))
    shake = Shake("all")
    alone = balance.solve([balance.term(shake, ())])
    assert abs(balance.mass_strain(alone)) > MOST_MASS_STRAIN
    assert named(select(balance, [shake])) == [shake.key]
    assert set(named(select(balance, [shake, *SubjectMass.candidates([short_scene])]))) == {
        shake.key,
        ("subject_mass", "all"),
    }


def test_a_wrong_mass_is_named_even_where_held_out_blocks_hardly_tell(short_scene, drawn, balance_of_scenes):
    """Masses follow the blocks that are not held out, so that naming one hardly predicts better."""
    shares = []
    for seed in range(5):
        balance = balance_of_scenes(drawn(seed, -0.08 * short_scene.measured_ground, scale=0.5))
        selection = select(balance, SubjectMass.candidates([short_scene]))
        assert named(selection) == [("subject_mass", "all")]
        (found,) = selection.found
        shares.append(found.held_out_gain / found.contender.gain)
    assert max(shares) < 0.9
    assert min(shares) > -MASS_HELD_OUT_SHARE


def test_a_mass_that_no_models_error_imitates_needs_less_to_be_named_first(
    short_scene, drawn, balance_of_scenes, monkeypatch
):
    balance = balance_of_scenes(drawn(4, -0.04 * short_scene.measured_ground, scale=0.5))
    (mass,) = SubjectMass.candidates([short_scene])
    gain = balance.solve([balance.term(mass, ())]).log_evidence - balance.solve([]).log_evidence
    assert least_first_gain(mass, 1.0, SETTINGS) < gain < SETTINGS.least_gain
    assert named(select(balance, [mass])) == [mass.key]
    monkeypatch.setattr(SubjectMass, "about", replace(mass.about, less_at_first=0.0))
    assert named(select(balance, [mass])) == []


def test_less_is_asked_where_the_model_has_next_to_no_errors_that_could_imitate_a_cause(short_scene):
    clock, mass = ClockOffset("all"), SubjectMass.candidates([short_scene])[0]
    quiet, usual = QUIET_SCALE, 2 * QUIET_SCALE
    assert least_first_gain(clock, quiet, SETTINGS) < least_first_gain(clock, usual, SETTINGS)
    assert least_first_gain(mass, quiet, SETTINGS) == least_first_gain(mass, usual, SETTINGS)


def test_what_is_too_small_to_act_on_is_not_named(short_scene, balance_of_scenes):
    """One percent of a gain, though nothing else is in the balance."""
    recorded = short_scene.measured_ground
    small = replace(short_scene, required_ground=recorded + 0.01 * short_scene.plates[0].wrench_ground)
    assert named(select(balance_of_scenes(small), [PlateGain("plate_1")])) == []


def test_what_held_out_blocks_tell_may_lack_a_small_share_of_the_gain(
    short_scene, drawn, rows_of, monkeypatch
):
    balance = Balance([rows_of(drawn(4, 0.15 * short_scene.plates[0].wrench_ground))], SETTINGS)
    selection = select(balance, [PlateGain("plate_1")])
    told = held_out_gain(balance, blocks(balance), selection.null, selection.solved).best
    (found,) = selection.found
    asks = told + 0.5 * HELD_OUT_SHARE * found.contender.gain
    monkeypatch.setattr(checks, "LEAST_HELD_OUT_NATS", asks)

    def with_share(share):
        monkeypatch.setattr(checks, "HELD_OUT_SHARE", share)
        return named(select(balance, [PlateGain("plate_1")]))

    assert with_share(HELD_OUT_SHARE) == [("plate_gain", "plate_1")]
    assert with_share(0.0) == []


def test_a_handicap_asks_for_more(short_scene, drawn, rows_of):
    """The same gain is named without and refused with odds that exceed what it brings."""
    rows = rows_of(drawn(4, 0.15 * short_scene.plates[0].wrench_ground))
    plain = select(
        Balance([rows], replace(SETTINGS, handicaps=(("plate_gain", 0.0),))), [PlateGain("plate_1")]
    )
    (found,) = plain.found
    dear = replace(SETTINGS, handicaps=(("plate_gain", found.contender.gain),))
    assert select(Balance([rows], dear), [PlateGain("plate_1")]).found == ()


def test_a_step_leaves_less_to_later_causes_than_a_contact(drawn, balance_of_scenes):
    """Its force and its place are free, a contact has one point; a factor tells all."""
    solved = balance_of_scenes(drawn(4)).solve([])
    gain = 100.0

    def rest(candidate):
        term = Term(candidate, (), None, np.zeros((0, 0)), np.zeros(0))
        return loose_ends([Found(Contender(term, solved, gain), 1.0, ())])

    assert rest(PlateGain("plate_1")) == 0.0
    assert rest(OffPlateStep("calcn_r")) == pytest.approx(STEP_REST_SHARE * gain)
    assert rest(ExternalContact("hand_r")) == pytest.approx(RIVAL_SHARE * gain)
    assert STEP_REST_SHARE < RIVAL_SHARE


def test_a_cause_that_mostly_undoes_another_is_not_added(short_scene, drawn):
    """Beside a large one, of which only the difference from it would be seen."""
    known = 0.3 * short_scene.plates[0].wrench_ground
    apart = np.zeros_like(known)
    apart[:, :3] = [14.0, 0.0, 0.0]
    apart[:, 3:] = np.cross(short_scene.com_ground, apart[:, :3])
    first, undoing, plain = (
        TimeHistory("first", known),
        TimeHistory("undoing", apart - known),
        TimeHistory("plain", apart),
    )
    balance = Balance([trial_rows_of(drawn(4, 2 * known + apart, scale=0.3))], SETTINGS)
    alone = balance.solve([balance.term(first, ())])
    both = balance.solve([balance.term(first, ()), balance.term(undoing, ())])
    assert both.log_evidence > alone.log_evidence + LEAST_FURTHER_NATS
    assert named(select(balance, [first, undoing])) == [first.key]
    assert set(named(select(balance, [first, plain]))) == {first.key, plain.key}


def said_of(selection, key):
    """Decisions on one cause of a selection, by name."""
    (one,) = [c for c in selection.trail.listed(set(named(selection))) if (c.id, c.target) == key]
    return one, {d.name: d for d in one.decisions}


def test_what_is_named_has_passed_all_that_was_asked_in_the_order_of_the_list(
    short_scene, drawn, balance_of_scenes
):
    balance = balance_of_scenes(drawn(4, 0.2 * short_scene.plates[0].wrench_ground))
    selection = select(balance, [PlateGain("plate_1"), PlateGain("plate_2")])
    one, said = said_of(selection, ("plate_gain", "plate_1"))
    assert one.named
    assert one.fell_at is None
    names = [d.name for d in one.decisions]
    assert names == [c.name for c in CHECKS if c.name in names]
    assert {"possible", "pays", "holds up", "stands alone", "notable", "needed", "decided"} <= set(names)
    assert said["pays"].nats >= said["pays"].limit == SETTINGS.least_gain
    assert all(d.reason for d in one.decisions if d.name != "possible")


@dataclass(frozen=True, eq=False)
class Impossible(TimeHistory):
    """A wrench that cannot be, however much it explains."""

    id = "impossible"
    nonlinear = (Nonlinear("place", (0.0,), step=1.0, bounds=(-np.inf, np.inf)),)

    def is_possible(self, estimates):
        return False


@pytest.mark.parametrize(
    "falls_at", ["checked", "possible", "pays", "holds up", "stands alone", "notable", "decided"]
)
def test_a_refused_cause_says_at_which_check_it_fell(short_scene, drawn, falls_at, monkeypatch):
    """The same fault, each time with one thing against the cause, and nothing else."""
    wrong = 0.15 * short_scene.plates[0].wrench_ground
    asks = {"pays": {"least_gain": 1e4}, "decided": {"certain_gain": 1e4, "least_confidence": 1.01}}
    plain = Balance([trial_rows_of(drawn(4, wrong))], SETTINGS)
    settings = replace(SETTINGS, **asks.get(falls_at, {}))
    balance = Balance(plain.trials, settings)
    if falls_at == "checked":
        balance = balance.with_checks({"plate_7"}, Weighings())
    if falls_at == "stands alone":
        cause = Helper("all")
        shaken = 0.05 * short_scene.required_ground * np.sin(20 * short_scene.times)[:, None]
        balance = plain = Balance([trial_rows_of(drawn(4, shaken, scale=0.3))], SETTINGS)
    else:
        kinds = {"possible": Impossible, "notable": Small}
        cause = kinds.get(falls_at, TimeHistory)("plate", wrong)
        assert named(select(plain, [TimeHistory("plate", wrong)])) == [("time_history", "plate")]
    if falls_at == "holds up":
        monkeypatch.setattr(checks, "LEAST_HELD_OUT_NATS", 1e4)
    selection = select(balance, [cause])
    assert named(selection) == []
    one, said = said_of(selection, cause.key)
    assert not one.named
    assert one.fell_at.name == falls_at
    assert one.fell_at.reason
    assert [d.name for d in one.decisions if not d.passed] == [falls_at]
    assert all(said[name].passed for name in said if name != falls_at)


@dataclass(frozen=True, eq=False)
class Small(TimeHistory):
    """A wrench that nobody would act on."""

    id = "small"

    def is_notable(self, estimates):
        return False


def test_a_cause_without_which_the_rest_does_as_well_is_not_needed(short_scene, drawn):
    """A limb makes way once the whole is there; the answer says so."""
    common = 0.3 * short_scene.plates[0].wrench_ground
    first, same = TimeHistory("first", common), TimeHistory("same", 1.001 * common)
    balance = Balance([trial_rows_of(drawn(4, common, scale=0.3))], SETTINGS)
    with_it = [balance.term(c, ()) for c in (first, same)]
    both, alone = balance.solve(with_it), balance.solve(with_it[:1])
    gain = both.log_evidence - alone.log_evidence
    verdict = Trail().put(Kept(balance, Contender(with_it[1], both, gain), alone))
    assert verdict.fell_at == "needed"
    only = balance.solve([])
    kept = Kept(balance, Contender(with_it[0], alone, alone.log_evidence - only.log_evidence), only)
    assert Trail().put(kept).fell_at is None


@pytest.mark.parametrize(("suspect", "named_still"), [((), True), (("plate",), True), (("plate_7",), False)])
def test_while_direct_checks_suspect_a_plate_only_causes_of_that_plate_are_named(
    short_scene, drawn, suspect, named_still
):
    wrong = 0.15 * short_scene.plates[0].wrench_ground
    balance = Balance([trial_rows_of(drawn(4, wrong))], SETTINGS).with_checks(suspect, Weighings())
    assert (
        named(select(balance, [TimeHistory("plate", wrong)])) == [("time_history", "plate")]
    ) == named_still


@pytest.mark.parametrize(("suspect", "rivals"), [((), {"body"}), (("plate",), set())])
def test_while_a_plate_is_suspect_other_causes_are_no_rivals_of_its_own(short_scene, drawn, suspect, rivals):
    """They may be there besides; in its place they would leave what the files say by themselves."""
    wrong = 0.15 * short_scene.plates[0].wrench_ground
    causes = [TimeHistory("plate", wrong), TimeHistory("body", wrong + np.roll(wrong, 20, axis=0))]
    balance = Balance([trial_rows_of(drawn(4, wrong))], SETTINGS).with_checks(suspect, Weighings())
    (found,) = select(balance, causes).found
    assert found.contender.term.candidate.target == "plate"
    assert {r.term.candidate.target for r in found.rivals} == rivals
    likely = tenable(balance, [found.contender, balance_contender(balance, causes[1])], balance.solve([]))
    assert {c.term.candidate.target for c in likely} == {"plate"} | rivals


def balance_contender(balance, cause):
    solved = balance.solve([balance.term(cause, ())])
    return Contender(solved.terms[0], solved, solved.log_evidence - balance.solve([]).log_evidence)


@dataclass(frozen=True, eq=False)
class Units(TimeHistory):
    """Says that its plate reads half of what is true."""

    def plate_factors(self):
        return {self.target: 0.5}


def carried(plate, mass_kg):
    """Somebody stands still on one plate."""
    return Weighing({plate: 9.80665 * mass_kg}, 9.80665)


@pytest.mark.parametrize(
    ("weighings", "named_still"),
    [
        (Weighings((carried("plate", 35.0),), entered_kg=70.0), True),
        (Weighings((carried("plate", 71.0),), entered_kg=70.0), False),
        (Weighings((carried("plate", 35.0), carried("plate_7", 70.0))), True),
        (Weighings((carried("plate", 70.0), carried("plate_7", 69.0))), False),
        (Weighings((carried("plate", 35.0),)), False),  # or a child
        (Weighings((carried("plate", 55.0), carried("plate_7", 20.0)), entered_kg=70.0), False),  # the other
        (Weighings(entered_kg=70.0), True),  # never all on plates: nothing speaks against it
    ],
)
def test_the_weight_that_a_plate_carries_by_itself_refutes_other_units(
    short_scene, drawn, weighings, named_still
):
    wrong = 0.5 * short_scene.plates[0].wrench_ground
    balance = Balance([trial_rows_of(drawn(4, wrong))], SETTINGS).with_checks((), weighings)
    selection = select(balance, [Units("plate", wrong)])
    assert (named(selection) == [("time_history", "plate")]) == named_still
    if not named_still:
        one, said = said_of(selection, ("time_history", "plate"))
        assert one.fell_at.name == "checked"
        assert "kg" in said["checked"].reason or "nobody entered" in said["checked"].reason


@dataclass(frozen=True, eq=False)
class Harness(TimeHistory):
    """Says that 200 N of the person are on no plate."""

    def lifted_N(self, trial, estimates):
        return 200.0


@pytest.mark.parametrize(("missing_kg", "named_still"), [(200.0 / 9.80665, True), (0.0, False)])
def test_plates_that_carry_the_whole_body_refute_a_harness(short_scene, drawn, missing_kg, named_still):
    """By each foot in turn."""
    wrong = 0.3 * short_scene.plates[0].wrench_ground
    mass_kg = short_scene.skeleton.mass - missing_kg
    weighed = [replace(carried(p, mass_kg), trial=short_scene.name) for p in ("plate_1", "plate_2")]
    rows = trial_rows_of(drawn(4, wrong))
    balance = Balance([rows], SETTINGS).with_checks((), Weighings(tuple(weighed)))
    selection = select(balance, [Harness("torso", wrong)])
    assert (named(selection) == [("time_history", "torso")]) == named_still
    _, said = said_of(selection, ("time_history", "torso"))
    assert said["checked"].passed == named_still
    assert "lifted" in said["checked"].reason


def test_a_clock_that_is_right_midway_is_not_told_as_both_a_delay_and_a_rate(
    short_scene, drawn, balance_of_scenes
):
    """The delay would only undo half of what the rate says."""
    midway = short_scene.times.mean()
    read = short_scene.retime(lambda times: times + 0.03 * (times - midway))
    balance = balance_of_scenes(drawn(4, read - short_scene.measured_ground, scale=0.3))
    assert len(named(select(balance, [ClockOffset("all"), SampleRate("all")]))) == 1
