"""Which causes are taken, in what order, and when none is."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.balance import Balance, Term
from solver.diagnosis.contenders import (
    Contender,
    Found,
    confidence,
    handicap,
    least_first_gain,
    loose_ends,
)
from solver.diagnosis.heldout import blocks, heldout_gain
from solver.diagnosis.selection import select
from solver.diagnosis_settings import DiagnosisSettings
from solver.effects.clock_offset import ClockOffset
from solver.effects.effect import Candidate, Corrected, Estimate, Signature
from solver.effects.external_contact import ExternalContact
from solver.effects.gross_cause import Beyond, with_samples
from solver.effects.off_plate_step import OffPlateStep
from solver.effects.plate_bias import candidates as biases
from solver.effects.plate_gain import PlateGain
from solver.effects.plate_position import candidates as positions
from solver.effects.plate_swap import PlateSwap
from solver.effects.segment_mass import SegmentMass
from solver.effects.segment_mass import candidates as segments
from solver.effects.subject_mass import candidates as masses
from solver.errors import Cancelled
from tests.solver.diagnosis.conftest import trial_rows_of

SETTINGS = DiagnosisSettings()


@pytest.fixture(scope="module")
def few(short_scene):
    """A small catalogue."""
    gains = [PlateGain(plate.target) for plate in short_scene.plates]
    return [*gains, *positions([short_scene]), *masses([short_scene]), ClockOffset("all")]


def named(selection) -> list[tuple[str, str]]:
    return [(f.contender.term.candidate.id, f.contender.term.candidate.target) for f in selection.found]


def test_nothing_is_found_in_what_model_errors_make(drawn, balance_of_scenes, few):
    assert [named(select(balance_of_scenes(drawn(seed)), few)) for seed in range(4)] == [[]] * 4


def test_two_causes_are_found_one_after_another_and_refitted_together(
    short_scene, drawn, balance_of_scenes, few
):
    missing = 0.15 * short_scene.plates[1].wrench_ground
    loads = short_scene.plates[0].wrench_ground
    moved = np.zeros_like(loads)
    moved[:, 3:] = np.cross([0.03, 0, 0.02], loads[:, :3])
    balance = balance_of_scenes(drawn(4, missing + moved, scale=0.5))
    selection = select(balance, few)
    assert set(named(selection)) == {("plate_gain", "plate_2"), ("plate_position", "plate_1")}
    assert len(selection.solved.terms) == 2
    assert selection.null.terms == ()
    assert selection.solved.log_evidence > selection.null.log_evidence
    k = [t.candidate.id for t in selection.solved.terms].index("plate_gain")
    gain = selection.solved.estimates(k, balance.scenes)["gain_error"]
    assert abs(gain.value - (1 / 1.15 - 1)) < 3 * gain.std
    assert all(f.heldout_gain > 0 and f.contender.gain > SETTINGS.least_gain for f in selection.found)
    assert all(c.term.candidate is not f.contender.term.candidate for f in selection.found for c in f.rivals)


@dataclass(frozen=True)
class Helper(Candidate):
    """Does what a lighter body does, but for a tenth that only a true cause would explain."""

    id = "helper"

    def signature(self, scene, eta):
        shaken = 0.05 * scene.demanded_ground * np.sin(20 * scene.times)[:, None]
        return Signature((shaken - 0.05 * scene.demanded_ground)[:, :, None], np.ones(1))

    def estimates(self, scenes, eta, eta_std, x, covariance):
        return {"size": Estimate(float(x[0]), float(np.sqrt(covariance[0, 0])))}

    def is_notable(self, estimates):
        return True


def test_a_cause_that_needs_a_body_of_another_mass_is_refused(short_scene, drawn, balance_of_scenes):
    """What shakes the plates is there; that it comes with a body 5 % lighter the entered mass denies."""
    shaken = 0.05 * short_scene.demanded_ground * np.sin(20 * short_scene.times)[:, None]
    balance = balance_of_scenes(drawn(4, shaken, scale=0.3))
    helper = Helper("all")
    leaning, nothing = balance.solve([balance.term(helper, ())]), balance.solve([])
    assert leaning.log_evidence - nothing.log_evidence > SETTINGS.least_gain
    assert abs(balance.mass_strain(leaning)) > SETTINGS.most_mass_strain > abs(balance.mass_strain(nothing))
    assert named(select(balance, [helper])) == []
    lenient = Balance(balance.trials, replace(SETTINGS, most_mass_strain=20.0))
    assert named(select(lenient, [helper])) == [helper.key]


def test_a_cause_far_ahead_of_all_others_stays_though_the_mass_is_wrong_as_well(
    short_scene, drawn, balance_of_scenes
):
    """A fault that nothing else resembles, and a person of another mass than entered."""
    measured = short_scene.measured_ground
    shaken = 0.3 * measured * np.sin(20 * short_scene.times)[:, None]
    balance = balance_of_scenes(drawn(4, shaken - 0.07 * measured, scale=0.3))
    shake = Shake("all")
    alone = balance.solve([balance.term(shake, ())])
    assert abs(balance.mass_strain(alone)) > SETTINGS.most_mass_strain
    assert named(select(balance, [shake])) == [shake.key]
    assert set(named(select(balance, [shake, *masses([short_scene])]))) == {
        shake.key,
        ("subject_mass", "all"),
    }


@dataclass(frozen=True)
class Shake(Helper):
    """Shakes what is demanded, and does nothing else."""

    id = "shake"

    def signature(self, scene, eta):
        shaken = scene.measured_ground * np.sin(20 * scene.times)[:, None]
        return Signature(shaken[:, :, None], np.ones(1))


def test_a_wrong_mass_is_named_even_where_withheld_blocks_hardly_tell(short_scene, drawn, balance_of_scenes):
    """Masses follow the blocks that are not withheld, so that naming one hardly foretells better."""
    shares = []
    for seed in range(5):
        balance = balance_of_scenes(drawn(seed, -0.08 * short_scene.measured_ground, scale=0.5))
        selection = select(balance, masses([short_scene]))
        assert named(selection) == [("subject_mass", "all")]
        (found,) = selection.found
        shares.append(found.heldout_gain / found.contender.gain)
    assert max(shares) < 0.9
    assert min(shares) > -SETTINGS.mass_heldout_share


def test_a_mass_that_no_models_error_imitates_needs_less_to_be_named_first(
    short_scene, drawn, balance_of_scenes
):
    balance = balance_of_scenes(drawn(4, -0.04 * short_scene.measured_ground, scale=0.5))
    (mass,) = masses([short_scene])
    gain = balance.solve([balance.term(mass, ())]).log_evidence - balance.solve([]).log_evidence
    assert least_first_gain(mass, 1.0, SETTINGS) < gain < SETTINGS.least_gain
    assert named(select(balance, [mass])) == [mass.key]
    as_any = Balance(balance.trials, replace(SETTINGS, never_imitated=()))
    assert named(select(as_any, [mass])) == []


def test_less_is_asked_where_the_model_has_next_to_no_errors_that_could_imitate_a_cause(short_scene):
    clock, mass = ClockOffset("all"), masses([short_scene])[0]
    quiet, usual = SETTINGS.quiet_scale, 2 * SETTINGS.quiet_scale
    assert least_first_gain(clock, quiet, SETTINGS) < least_first_gain(clock, usual, SETTINGS)
    assert least_first_gain(mass, quiet, SETTINGS) == least_first_gain(mass, usual, SETTINGS)


def test_one_leg_alone_is_rarer_than_both(short_scene):
    usual = {c.target: handicap(c, SETTINGS) for c in segments([short_scene])}
    assert usual["femur_r"] == usual["femur_l"] > usual["femur_r+femur_l"]


def test_a_later_cause_makes_room_for_a_better_first_one(short_scene, drawn, balance_of_scenes):
    """Whatever the order of discovery, no exchange of one cause for another would gain any more."""
    loads = short_scene.plates[0].wrench_ground
    moved = np.zeros_like(loads)
    moved[:, 3:] = np.cross([0.03, 0, 0.02], loads[:, :3])
    catalogue = [
        *[PlateGain(plate.target) for plate in short_scene.plates],
        *biases([short_scene]),
        *positions([short_scene]),
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
            other = balance.solve([*rest, balance.term(candidate, ())], near=selection.solved.rung)
            least = SETTINGS.exchange_margin + handicap(candidate, SETTINGS)
            own = handicap(terms[k].candidate, SETTINGS)
            assert other.log_evidence - least < selection.solved.log_evidence - own + 1e-6


@dataclass(frozen=True, eq=False)
class Course(Candidate):
    """A wrench of known course and unknown size."""

    wrench_ground: np.ndarray

    id = "course"

    def signature(self, scene, eta):
        return Signature(self.wrench_ground[:, :, None], np.ones(1))

    def estimates(self, scenes, eta, eta_std, x, covariance):
        return {"size": Estimate(float(x[0]), float(np.sqrt(covariance[0, 0])))}

    def is_notable(self, estimates):
        return abs(estimates["size"].value) > 0.2


def test_two_that_stand_out_only_together_are_named(short_scene, drawn):
    """What two causes have in common cancels: each alone explains next to nothing of what is left."""
    common = 0.3 * short_scene.plates[0].wrench_ground
    apart = np.zeros_like(common)
    apart[:, :3] = [9.0, 0.0, 0.0]
    apart[:, 3:] = np.cross(short_scene.com_ground, apart[:, :3])
    one, other = Course("one", apart + common), Course("other", apart - common)
    scene = drawn(4, 2 * apart, scale=0.3)
    settings = replace(SETTINGS, least_of_two=-10.0)
    balance = Balance([trial_rows_of(scene)], settings)
    nothing = balance.solve([]).log_evidence
    for alone in (one, other):
        assert balance.solve([balance.term(alone, ())]).log_evidence - nothing < SETTINGS.least_gain
        assert named(select(balance, [alone])) == []
    selection = select(balance, [one, other])
    assert set(named(selection)) == {one.key, other.key}
    assert selection.solved.log_evidence - nothing > SETTINGS.least_gain + SETTINGS.least_further_gain
    assert (
        named(select(Balance([trial_rows_of(scene)], replace(settings, tried_in_pairs=0)), [one, other]))
        == []
    )


def test_what_is_too_small_to_act_on_is_not_named(short_scene, balance_of_scenes, few):
    """One percent of a gain, though nothing else is in the balance."""
    recorded = short_scene.measured_ground
    small = replace(short_scene, demanded_ground=recorded + 0.01 * short_scene.plates[0].wrench_ground)
    assert named(select(balance_of_scenes(small), [PlateGain("plate_1")])) == []


@dataclass(frozen=True)
class Shaken(Corrected):
    """Reading the files took 40 N off."""

    id = "shaken"

    def signature(self, scene, eta):
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), np.zeros((scene.frames, 6)))

    def uncorrected_ground(self, scene):
        return scene.measured_ground + np.array([40.0, 0, 0, 0, 0, 0])

    def estimates(self, scenes, eta, eta_std, x, covariance):
        return {"force_N": Estimate(40.0, 1.0)}

    def is_notable(self, estimates):
        return True


def test_what_reading_undid_is_named_if_leaving_it_in_would_cost(drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(1))
    selection = select(balance, [Shaken("all")])
    (one,) = selection.corrected
    assert one.key == ("shaken", "all")
    assert named(selection) == []
    (left_in,) = selection.uncorrected
    worse = balance.solve([left_in]).log_evidence
    assert one.contender.gain == pytest.approx(selection.solved.log_evidence - worse, abs=1e-6)


@pytest.mark.parametrize("exchanged", [True, False])
def test_what_reading_undid_is_told_of_the_plate_that_has_it_in_the_recording_put_right(
    drawn, balance_of_scenes, exchanged
):
    """Of plate 1 as the files number them, which hold there, if they are exchanged, what plate 2 measured."""
    sound = drawn(1)
    recorded = replace(sound, plates=PlateSwap("plate_1+plate_2").put_right(sound.plates))
    balance = balance_of_scenes(recorded if exchanged else sound)
    selection = select(balance, [PlateSwap("plate_1+plate_2"), Shaken("plate_1")])
    assert [name for name, _ in named(selection)] == (["plate_swap"] if exchanged else [])
    assert [c.key for c in selection.corrected] == [("shaken", "plate_2" if exchanged else "plate_1")]


def with_gain_of_the_second_then_exchanged(sound):
    first, second, *others = sound.plates
    loads = second.loads
    strong = with_samples(second, 1.1 * loads.wrench_ground, loads.carrying)
    wrong = replace(sound, plates=(first, strong, *others))
    return replace(wrong, plates=PlateSwap("plate_1+plate_2").put_right(wrong.plates))


def test_beyond_an_exchange_causes_have_the_plates_own_names(drawn, balance_of_scenes):
    """In the files the second plate's force stands in the first one's columns, and so does its gain."""
    balance = balance_of_scenes(with_gain_of_the_second_then_exchanged(drawn(1)))
    selection = select(balance, [PlateSwap("plate_1+plate_2"), PlateGain("plate_1"), PlateGain("plate_2")])
    assert set(named(selection)) == {("plate_swap", "plate_1+plate_2"), ("plate_gain", "plate_2")}


def test_beyond_an_exchange_the_catalogue_is_that_of_the_recording_put_right(drawn, balance_of_scenes):
    scene = with_gain_of_the_second_then_exchanged(drawn(1))
    swap = PlateSwap("plate_1+plate_2")
    balance = balance_of_scenes(scene)

    def put_right_only(scenes):
        same = np.allclose(scenes[0].measured_ground, swap.righted(scene).measured_ground)
        return [PlateGain("plate_2")] if same else []

    assert named(select(balance, [swap])) == [swap.key]
    selection = select(balance, [swap], candidates_of=put_right_only)
    assert set(named(selection)) == {swap.key, ("plate_gain", "plate_2")}


def test_what_withheld_blocks_tell_may_lack_a_small_share_of_the_gain(short_scene, drawn, rows_of):
    balance = Balance([rows_of(drawn(4, 0.15 * short_scene.plates[0].wrench_ground))], SETTINGS)
    selection = select(balance, [PlateGain("plate_1")])
    told = heldout_gain(balance, blocks(balance), selection.null, selection.solved).best
    (found,) = selection.found
    asks = told + 0.5 * SETTINGS.heldout_share * found.contender.gain

    def with_share(share):
        settings = replace(SETTINGS, least_heldout_gain=asks, heldout_share=share)
        return named(select(Balance(balance.trials, settings), [PlateGain("plate_1")]))

    assert with_share(SETTINGS.heldout_share) == [("plate_gain", "plate_1")]
    assert with_share(0.0) == []


def test_what_reading_undid_is_not_named_if_leaving_it_in_would_do(drawn, balance_of_scenes, short_scene):
    lost = np.zeros((short_scene.frames, 6))
    lost[:, 0] = 40.0  # taken off where it belonged
    balance = balance_of_scenes(drawn(1, lost))
    assert select(balance, [Shaken("all")]).corrected == ()


def test_confidence_is_a_share_among_rivals_and_none(drawn, balance_of_scenes, short_scene):
    balance = balance_of_scenes(drawn(4, 0.2 * short_scene.plates[0].wrench_ground))
    found = select(balance, [PlateGain("plate_1"), PlateGain("plate_2"), *positions([short_scene])]).found[0]
    one = found.contender
    temper = SETTINGS.confidence_temper
    odds = [c.gain - handicap(c.term.candidate, SETTINGS) for c in (one, *found.rivals)]
    weights = np.exp((np.array([*odds, 0.0]) - odds[0]) / temper)
    assert confidence(one, found.rivals, SETTINGS) == pytest.approx(1 / weights.sum())
    assert confidence(one, (one, *found.rivals), SETTINGS) == pytest.approx(1 / weights.sum())
    alone = confidence(one, (), SETTINGS)
    assert alone >= confidence(one, found.rivals, SETTINGS)
    twin = replace(
        found.rivals[0],
        gain=one.gain
        - handicap(one.term.candidate, SETTINGS)
        + handicap(found.rivals[0].term.candidate, SETTINGS),
    )
    assert confidence(one, (twin,), SETTINGS) == pytest.approx(0.5, abs=0.01)


@dataclass(frozen=True, eq=False)
class SeenElsewhere(Course):
    """A small one that something else than the balance shows."""

    id = "seen"

    @property
    def seen_elsewhere(self):
        return 1000.0


def test_what_is_known_from_elsewhere_does_not_end_the_search(short_scene, drawn):
    """It hardly helps the balance, in which something else is wrong as well."""
    small = np.zeros((short_scene.frames, 6))
    small[:, 0] = 3.0
    small[:, 3:] = np.cross(short_scene.com_ground, small[:, :3])
    large = 0.15 * short_scene.plates[1].wrench_ground
    known, other = SeenElsewhere("known", small), Course("other", large)
    balance = Balance([trial_rows_of(drawn(4, small + large, scale=0.3))], SETTINGS)
    nothing = balance.solve([]).log_evidence
    assert balance.solve([balance.term(known, ())]).log_evidence < nothing + SETTINGS.least_gain
    assert named(select(balance, [known, other])) == [known.key, other.key]


@dataclass(frozen=True, eq=False)
class Limb(Course):
    """Rare, seldom large, and never as large as it would have to be alone."""

    id = "limb"

    def signature(self, scene, eta):
        return Signature(self.wrench_ground[:, :, None], np.full(1, 0.3))

    def is_notable(self, estimates):
        return 0.2 < abs(estimates["size"].value) < 0.9


def test_nothing_is_lost_by_a_cause_that_is_taken_back_with_the_one_it_made_needless(short_scene, drawn):
    """Beside the first a limb is small enough; without it, no longer."""
    common = 0.3 * short_scene.plates[0].wrench_ground
    apart = np.zeros_like(common)
    apart[:, :3] = [8.0, 0.0, 0.0]
    apart[:, 3:] = np.cross(short_scene.com_ground, apart[:, :3])
    whole, limb = Course("whole", common), Limb("limb", common + apart)
    balance = Balance([trial_rows_of(drawn(4, common + apart, scale=0.3))], SETTINGS)
    alone, both = ([balance.term(c, ()) for c in some] for some in ([limb], [whole, limb]))
    sizes = [
        balance.solve(terms).estimates(len(terms) - 1, balance.scenes)["size"].value
        for terms in (alone, both)
    ]
    assert abs(sizes[1]) < 0.9 < abs(sizes[0])
    assert named(select(balance, [whole, limb])) == [whole.key]


@dataclass(frozen=True, eq=False)
class Bounded(Course):
    """Of bounded size, and seldom large."""

    id = "bounded"
    least: float = 0.0
    most: float = 0.0
    usual: float = 1.0

    def signature(self, scene, eta):
        return Signature(self.wrench_ground[:, :, None], np.full(1, self.usual))

    def is_notable(self, estimates):
        return self.least < abs(estimates["size"].value) < self.most


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

    assert solved(both, second)[0] > solved(first, second)[0] + SETTINGS.exchange_margin
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


def test_who_wants_to_stop_can(drawn, balance_of_scenes):
    def progress(stage, fraction):
        raise Cancelled

    with pytest.raises(Cancelled):
        select(balance_of_scenes(drawn(1)), [PlateGain("plate_1")], progress)


def test_a_handicap_asks_for_more(short_scene, drawn, rows_of):
    """The same gain is named without and refused with odds that exceed what it brings."""
    rows = rows_of(drawn(4, 0.15 * short_scene.plates[0].wrench_ground))
    plain = select(Balance([rows], replace(SETTINGS, handicaps=())), [PlateGain("plate_1")])
    (found,) = plain.found
    dear = replace(SETTINGS, handicaps=(("plate_gain", found.contender.gain),))
    assert select(Balance([rows], dear), [PlateGain("plate_1")]).found == ()


@pytest.mark.parametrize(("lead", "first"), [(10.0, "seen_gain"), (0.0, "plate_gain")])
def test_what_is_seen_without_forces_is_tried_before_its_equals(short_scene, drawn, rows_of, lead, first):
    """The same trace at odds of 5 nats: as a foot that stands where no plate is, beside a harness."""

    @dataclass(frozen=True)
    class SeenGain(PlateGain):
        id = "seen_gain"
        has_a_witness = True

    rows = rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    settings = replace(SETTINGS, handicaps=(("seen_gain", 5.0),), witness_lead=lead, least_confidence=0.0)
    found = select(Balance([rows], settings), [PlateGain("plate_2"), SeenGain("plate_2")]).found
    assert [f.contender.term.candidate.id for f in found] == [first]


def test_whole_limbs_are_likelier_than_single_segments():
    pair = SegmentMass("femur_r+femur_l")
    legs = SegmentMass("femur_r+tibia_r+femur_l+tibia_l")
    nearer = handicap(pair, SETTINGS) - handicap(legs, SETTINGS)
    assert nearer == SETTINGS.whole_limbs_odds > 0
    beyond = Beyond(legs.target, legs, PlateSwap("plate_1+plate_2"))
    assert handicap(beyond, SETTINGS) == handicap(legs, SETTINGS)


def test_a_step_leaves_less_to_later_causes_than_a_contact(drawn, balance_of_scenes):
    """Its force and its place are free, a contact has one point; a factor tells all."""
    solved = balance_of_scenes(drawn(4)).solve([])
    gain = 100.0

    def rest(candidate):
        term = Term(candidate, (), None, np.zeros((0, 0)), np.zeros(0))
        return loose_ends([Found(Contender(term, solved, gain), 1.0, ())], SETTINGS)

    assert rest(PlateGain("plate_1")) == 0.0
    assert rest(OffPlateStep("calcn_r")) == pytest.approx(SETTINGS.step_rest_share * gain)
    assert rest(ExternalContact("hand_r")) == pytest.approx(SETTINGS.rival_share * gain)
    assert SETTINGS.step_rest_share < SETTINGS.rival_share


def test_a_forearm_is_touched_more_rarely_than_a_hand():
    hand, forearm = ExternalContact("hand_r"), ExternalContact("ulna_r", between_others=True)
    farther = handicap(forearm, SETTINGS) - handicap(hand, SETTINGS)
    assert farther == SETTINGS.rare_place_odds > 0
    beyond = Beyond(forearm.target, forearm, PlateSwap("plate_1+plate_2"))
    assert handicap(beyond, SETTINGS) == handicap(forearm, SETTINGS)


def test_a_cause_that_mostly_undoes_another_is_not_added(short_scene, drawn):
    """Beside a large one, of which only the difference from it would be seen."""
    known = 0.3 * short_scene.plates[0].wrench_ground
    apart = np.zeros_like(known)
    apart[:, :3] = [14.0, 0.0, 0.0]
    apart[:, 3:] = np.cross(short_scene.com_ground, apart[:, :3])
    first, undoing, plain = Course("first", known), Course("undoing", apart - known), Course("plain", apart)
    balance = Balance([trial_rows_of(drawn(4, 2 * known + apart, scale=0.3))], SETTINGS)
    alone = balance.solve([balance.term(first, ())])
    both = balance.solve([balance.term(first, ()), balance.term(undoing, ())])
    assert both.log_evidence > alone.log_evidence + SETTINGS.least_further_gain
    assert named(select(balance, [first, undoing])) == [first.key]
    assert set(named(select(balance, [first, plain]))) == {first.key, plain.key}


@dataclass(frozen=True)
class Swing(Shake):
    """Swings of what the plates measure, at some rates together."""

    rates: tuple[tuple[float, float], ...] = ()  # [rad/s], share

    id = "swing"

    def signature(self, scene, eta):
        return Signature(_swung(scene, self.rates)[:, :, None], np.ones(1))


@dataclass(frozen=True)
class RareSwing(Swing):
    """Likewise, but seldom met."""

    id = "rare_swing"


@dataclass(frozen=True)
class SmallSwing(Swing):
    """Likewise, beside it."""

    id = "small_swing"


def _swung(scene, rates):
    return scene.measured_ground * sum(share * np.sin(rate * scene.times) for rate, share in rates)[:, None]


def test_of_causes_that_do_nearly_as_well_the_one_stays_beside_which_others_show(
    short_scene, drawn, balance_of_scenes
):
    """A usual cause that says most of it hides a small one; a rare one that says all of it does not."""
    true, imitation = RareSwing("all", rates=((20.0, 1.0),)), Swing("all", rates=((20.0, 0.9), (33.0, 0.45)))
    small = SmallSwing("all", rates=((9.0, 1.0),))
    wrong = _swung(short_scene, ((20.0, 0.25), (9.0, 0.04)))
    balance = balance_of_scenes(drawn(3, wrong, scale=0.3))
    alone = [balance.solve([balance.term(one, ())]).log_evidence for one in (true, imitation)]
    against = alone[0] - alone[1] + 2.0
    assert against > 0

    def found(most_starts):
        settings = replace(SETTINGS, handicaps=(("rare_swing", against),), most_starts=most_starts)
        return set(named(select(Balance(balance.trials, settings), [true, imitation, small])))

    assert found(0) == {imitation.key}
    assert found(2) == {true.key, small.key}
