"""From what was selected to a verdict."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.cause_decisions import UNEXPLAINED_SCALE
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.body_masses import CarriedMass, SubjectMass
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.marker_effect import MarkerFinding
from solver.diagnosis.causes.observed_trial import force_at
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.conclusion import STD_INFLATION, SURE_BESIDE_UNEXPLAINED, conclude, likeness
from solver.diagnosis.diagnosis import CLEAN, EXPLAINED, UNEXPLAINED
from solver.diagnosis.held_out_gain import block_scores, blocks
from solver.diagnosis.marker_causes import SeenInMarkers
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import RIVAL_NATS
from solver.diagnosis.search.selection import Selection, select
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.simulate.other_masses import with_carried_mass
from solver.skeleton.scaling import with_mass

SETTINGS = DiagnosisSettings()
EQUAL_ODDS = (("plate_gain", 0.0), ("counterpart_gain", 0.0), *((f"gain_{k}", 0.0) for k in range(5)))


@dataclass(frozen=True, eq=False)
class Slip(MarkerFinding):
    about = About("marker_slip", sentence="{target} slipped.", remedy="Tape {target}.")

    def repair(self, observed_ground):
        return observed_ground


@pytest.fixture(scope="module")
def sound(drawn, balance_of_scenes):
    return balance_of_scenes(drawn(1))


@pytest.fixture(scope="module")
def weak(short_scene, drawn, balance_of_scenes):
    """Plate 2 reads too little."""
    return balance_of_scenes(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))


@pytest.fixture(scope="module")
def few(short_scene):
    return [PlateGain("plate_1"), PlateGain("plate_2"), *PlatePosition.candidates([short_scene])]


def test_model_errors_alone_are_clean(sound, few):
    diagnosis = conclude(sound, select(sound, few))
    assert diagnosis.verdict == CLEAN
    assert (diagnosis.effects, diagnosis.alternatives, diagnosis.gain) == ((), (), {})
    assert diagnosis.remaining.location is None
    assert diagnosis.trials == ("walk",)


def test_a_named_cause_explains(weak, few):
    selection = select(weak, few)
    diagnosis = conclude(weak, selection)
    (effect,) = diagnosis.effects
    assert diagnosis.verdict == EXPLAINED
    assert (effect.id, effect.target) == ("plate_gain", "plate_2")
    assert effect.frames == (("walk", 0, weak.scenes[0].frames),)
    assert diagnosis.at_fault == (effect.at_fault,) == ("recording",)
    assert "plate_2" in effect.sentence
    assert 0.5 < effect.confidence <= 1
    raw = selection.solved.estimates(0, weak.scenes)["gain_error"]
    said = effect.parameters["gain_error"]
    assert said.value == pytest.approx(raw.value)
    assert said.std == pytest.approx(STD_INFLATION * raw.std)


def test_the_gain_is_that_of_held_out_blocks(weak, few):
    selection = select(weak, few)
    gain = conclude(weak, selection).gain
    some = blocks(weak)
    before = block_scores(weak, [], selection.solved.noise_scale, some).rms()
    after = block_scores(weak, selection.solved.terms, selection.solved.noise_scale, some).rms()
    for i, name in enumerate(("held_out_linear_residual_N", "held_out_angular_residual_Nm")):
        assert (gain[name].before, gain[name].after) == pytest.approx((before[i], after[i]))
        low, high = gain[name].interval
        assert low < gain[name].after < high
    assert gain["held_out_linear_residual_N"].after < gain["held_out_linear_residual_N"].before


def test_errors_too_large_for_sound_recordings_are_unexplained(drawn, balance_of_scenes, few):
    balance = balance_of_scenes(drawn(16, scale=6.0))
    selection = select(balance, few)
    assert selection.solved.noise_scale.scale > UNEXPLAINED_SCALE
    assert conclude(balance, selection).verdict == UNEXPLAINED


def test_a_named_cause_keeps_its_name_when_something_is_left_beside_it(short_scene, drawn, balance_of_scenes):
    b = short_scene.skeleton.body_index("hand_l")
    place = short_scene.point_ground(b, short_scene.skeleton.bodies[b].com_body)
    pull = force_at(np.tile([50.0, 0.0, 20.0], (short_scene.frames, 1)), place)
    missing = 0.2 * short_scene.plates[1].wrench_ground + pull
    balance = balance_of_scenes(drawn(4, missing, scale=0.5))
    diagnosis = conclude(balance, select(balance, [PlateGain("plate_2")]))
    assert diagnosis.verdict == UNEXPLAINED
    assert [(e.id, e.target) for e in diagnosis.effects] == [("plate_gain", "plate_2")]
    assert diagnosis.effects[0].confidence <= SURE_BESIDE_UNEXPLAINED  # it may stand in for the rest
    assert diagnosis.remaining.location.body == "hand_l"


def test_what_markers_showed_is_named_and_excludes_clean(sound):
    finding = Slip(
        target="RASI", parameters={"shift_m": Estimate(0.02, 0.001)}, frames=Range("walk", 40, 90), gain=200.0
    )
    diagnosis = conclude(sound, select(sound, []), SeenInMarkers((finding,), 0.02, 0.01))
    (effect,) = diagnosis.effects
    assert diagnosis.verdict == EXPLAINED
    assert (effect.id, effect.target, effect.frames) == ("marker_slip", "RASI", (("walk", 40, 90),))
    assert (effect.sentence, effect.remedy) == ("RASI slipped.", "Tape RASI.")
    assert (diagnosis.gain["marker_rms_m"].before, diagnosis.gain["marker_rms_m"].after) == (0.02, 0.01)


def test_effects_come_in_order_of_falling_confidence(weak, few):
    unsure = Slip(target="RASI", parameters={}, frames=Range("walk", 4, 9), gain=1.0)
    effects = conclude(weak, select(weak, few), SeenInMarkers((unsure,))).effects
    assert [e.id for e in effects] == ["plate_gain", "marker_slip"]
    assert effects[0].confidence > effects[1].confidence


def test_a_rival_that_does_as_well_is_an_alternative_with_what_tells_them_apart(short_scene, drawn, rows_of):
    """Another gain of the same plate under another name."""

    @dataclass(frozen=True)
    class Twin(PlateGain):
        about = replace(PlateGain.about, id="counterpart_gain", separate_by="nothing at all")

    rows = rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    balance = Balance([rows], replace(SETTINGS, handicaps=EQUAL_ODDS, least_confidence=0.0))
    diagnosis = conclude(balance, select(balance, [PlateGain("plate_2"), Twin("plate_2")]))
    (effect,) = diagnosis.effects
    (other,) = diagnosis.alternatives
    assert {effect.id, other.id} == {"plate_gain", "counterpart_gain"}
    assert other.instead_of == f"{effect.id} plate_2"
    assert "cosine 1.00" in other.why
    assert other.separate_by
    assert effect.confidence < 0.6
    assert effect.confidence + other.confidence == pytest.approx(1.0, abs=0.01), "nothing else was tried"


def test_of_two_rivals_the_second_is_of_another_kind(short_scene, drawn, rows_of):
    """Three likely ones of two kinds, and a last one of a third: the likeliest and the last are told."""

    @dataclass(frozen=True)
    class Twin(PlateGain):
        id: str = "counterpart_gain"
        name: str = ""

    rows = rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    odds = (("first", 0.0), ("second", 0.5), ("third", 1.5))
    balance = Balance([rows], replace(SETTINGS, handicaps=odds, least_confidence=0.0))
    counterparts = [Twin("plate_2", id, name) for id, name in (("first", ""), ("second", "a"), ("third", ""))]

    @dataclass(frozen=True)
    class Elsewhere(Twin):
        """The same of another name, so that it is another target."""

        @property
        def key(self):
            return self.id, self.name

    counterparts.insert(1, Elsewhere("plate_2", "second", "b"))
    diagnosis = conclude(balance, select(balance, counterparts))
    assert diagnosis.effects[0].id == "first"
    assert [a.id for a in diagnosis.alternatives] == ["second", "third"]


def test_what_only_its_odds_keep_back_is_told_all_the_same(short_scene, drawn, rows_of):
    """A cause of less evidence, but likelier by itself, is as good a guess."""

    @dataclass(frozen=True)
    class Rare(PlateGain):
        id: str = "rare_gain"

    @dataclass(frozen=True)
    class Common(PlateGain):
        """It explains a little less."""

        id: str = "common_gain"

        def signature(self, scene, eta):
            if (signature := super().signature(scene, eta)) is None:
                return None
            bent = signature.columns.copy()
            bent[:, 0] += 0.3 * bent[:, 1]
            return replace(signature, columns=bent)

    rows = rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.3))

    def told(handicap):
        odds = (*EQUAL_ODDS, ("rare_gain", handicap))
        balance = Balance([rows], replace(SETTINGS, handicaps=odds, least_confidence=0.0))
        selection = select(balance, [Rare("plate_2"), Common("plate_2")])
        (found,) = selection.found
        diagnosis = conclude(balance, selection)
        return found, diagnosis.effects[0].id, [a.id for a in diagnosis.alternatives]

    found, best, others = told(0.0)
    behind = found.contender.gain - found.rivals[0].gain
    assert (best, others) == ("rare_gain", [])
    assert behind > 2 * RIVAL_NATS
    assert told(behind - 1.0)[1:] == ("rare_gain", ["common_gain"])


def test_no_more_rivals_are_told_than_anybody_can_look_into(short_scene, drawn, rows_of):
    @dataclass(frozen=True)
    class Twin(PlateGain):
        id: str = "counterpart_gain"

    rows = rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    balance = Balance([rows], replace(SETTINGS, handicaps=EQUAL_ODDS, least_confidence=0.0))
    counterparts = [Twin("plate_2", f"gain_{k}") for k in range(5)]
    diagnosis = conclude(balance, select(balance, counterparts))
    told = {diagnosis.effects[0].id, *(a.id for a in diagnosis.alternatives)}
    assert len(diagnosis.effects) == 1
    assert len(told) == 3


def test_likeness_is_the_cosine_between_whitened_signatures(sound):
    one, other = (sound.term(PlateGain(t), ()) for t in ("plate_1", "plate_2"))
    solved = sound.solve([one])
    K = solved.noise_scale.covariance
    a, b = one.columns[:, 0], other.columns[:, 0]
    Q = np.linalg.inv(K)
    expected = abs(a @ Q @ b) / np.sqrt((a @ Q @ a) * (b @ Q @ b))
    assert likeness(one, other, solved) == pytest.approx(expected, rel=1e-6)
    assert likeness(one, one, solved) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "kg",  # of body, load and scale, beyond what was entered
    [
        (0.0, 0.0, 0.3, set()),
        (4.0, 0.0, 4.0, {"subject_mass"}),
        (4.0, 0.0, 0.0, {"plate_gain"}),
        (0.0, 5.0, 5.0, {"carried_mass"}),
        (-5.0, 5.0, 0.0, {"carried_mass"}),
    ],
)
def test_a_scale_tells_what_it_holds(short_scene, drawn, demands, balance_of_scenes, kg):
    body_kg, load_kg, scale_kg, named = kg
    entered, causes = short_scene.skeleton, (SubjectMass, CarriedMass, PlateGain)
    true = with_carried_mass(with_mass(entered, entered.mass + body_kg), "hand_l", load_kg, np.zeros(3))
    seen = drawn(4, short_scene.required_ground - demands(true), scale=0.2)
    balance = balance_of_scenes(replace(seen, scale_factor=1 + scale_kg / entered.mass))
    found = conclude(balance, select(balance, [c for one in causes for c in one.candidates([short_scene])]))
    assert {e.id for e in found.effects} == named
    for told in (e.parameters for e in found.effects):
        for name, value in (("mass_kg", load_kg), ("mass_factor", true.mass / entered.mass)):
            assert name not in told or abs(told[name].value - value) < 2 * told[name].std


def test_nothing_selected_and_nothing_seen_needs_no_candidates(sound):
    null = sound.solve([])
    assert conclude(sound, Selection(null, null, ())).verdict == CLEAN
