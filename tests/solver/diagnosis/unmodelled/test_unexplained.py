"""Named causes beside a force of unknown time history that may take their place."""

from dataclasses import dataclass

import numpy as np
import pytest

from solver.diagnosis import checks
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.body_masses import SubjectMass
from solver.diagnosis.causes.effect import Candidate, Signature
from solver.diagnosis.causes.observed_trial import force_at
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.search.contenders import LEAST_UNKNOWN_NATS, Contender, Found
from solver.diagnosis.search.selection import Selection, select
from solver.diagnosis.unmodelled import unexplained
from solver.diagnosis.unmodelled.remainder import UnknownForce
from solver.diagnosis.unmodelled.unexplained import MOST_CONSTANT, keep_beside_the_unknown


@dataclass(frozen=True, eq=False)
class Steady(Candidate):
    """A constant pull at a body's centre of mass: half of the truth."""

    id = "steady"

    def signature(self, scene, eta):
        b = scene.skeleton.body_index(self.target)
        point = scene.point_ground(b, scene.skeleton.bodies[b].com_body)
        pull = np.tile([1.0, 0.0, 0.0], (scene.frames, 1))
        return Signature(force_at(pull, point)[:, :, None], np.array([60.0]))

    parameters = ("force_N",)
    least = 5.0


def at_the_hand(scene, force):
    b = scene.skeleton.body_index("hand_l")
    return force_at(np.asarray(force), scene.point_ground(b, scene.skeleton.bodies[b].com_body))


@pytest.fixture(scope="module")
def swinging(short_scene):
    """A force at a hand that comes and goes."""
    time_history = 25.0 + 60.0 * np.sin(2 * np.pi * 1.7 * short_scene.times)
    return at_the_hand(short_scene, time_history[:, None] * np.array([1.0, 0.0, 0.0]))


def kept_of(balance, *candidates):
    """What is kept of causes that were named together, however they came to be."""
    solved = balance.solve([balance.term(c, ()) for c in candidates])
    found = tuple(Found(Contender(t, solved, 50.0), 1.0, ()) for t in solved.terms)
    return keep_beside_the_unknown(balance, Selection(balance.solve([]), solved, found))


def test_a_true_cause_stays_though_a_free_force_might_imitate_it(short_scene, drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(4, 0.15 * short_scene.plates[0].wrench_ground, scale=0.5))
    selection = select(balance, [PlateGain("plate_1"), PlateGain("plate_2")])
    kept = keep_beside_the_unknown(balance, selection)
    assert [f.contender.term.candidate.key for f in kept.found] == [("plate_gain", "plate_1")]
    assert kept.left is None
    assert kept.solved is selection.solved
    (told,) = [c for c in selection.trail.listed({("plate_gain", "plate_1")}) if c.named]
    assert told.fell_at is None
    assert "beats the unknown" in {d.name for d in told.decisions}


def test_what_describes_a_force_badly_gives_way_to_the_unknown(swinging, drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(4, swinging, scale=0.5))
    selection = select(balance, [Steady("hand_l")])
    assert len(selection.found) == 1
    kept = keep_beside_the_unknown(balance, selection)
    assert kept.found == ()
    assert isinstance(kept.left.term.candidate, UnknownForce)
    assert kept.left.term.candidate.target == "hand_l"
    assert kept.solved.terms == ()
    (told,) = selection.trail.listed(())
    assert [d.name for d in told.decisions if not d.passed] == ["beats the unknown"]
    assert told.fell_at.nats < told.fell_at.limit


def test_a_cause_that_pays_beside_the_unknown_is_named_with_it(
    short_scene, swinging, drawn, balance_of_scenes
):
    missing = swinging + 0.2 * short_scene.plates[0].wrench_ground
    balance = balance_of_scenes(drawn(4, missing, scale=0.5))
    kept = keep_beside_the_unknown(balance, select(balance, [PlateGain("plate_1")]))
    assert [f.contender.term.candidate.key for f in kept.found] == [("plate_gain", "plate_1")]
    assert kept.left.term.candidate.target == "hand_l"


def test_beside_a_strong_unknown_a_cause_has_to_pay_more(
    short_scene, swinging, drawn, balance_of_scenes, monkeypatch
):
    """No time history of a free force is described whole, and what it leaves suits many a cause."""
    missing = swinging + 0.2 * short_scene.plates[0].wrench_ground
    plain = balance_of_scenes(drawn(4, missing, scale=0.5))

    def kept(share):
        monkeypatch.setattr(checks, "BESIDE_UNKNOWN_SHARE", share)
        return keep_beside_the_unknown(plain, select(plain, [PlateGain("plate_1")]))

    lenient = kept(0.0)
    assert [f.contender.term.candidate.id for f in lenient.found] == ["plate_gain"]
    alone = plain.solve([lenient.left.term])
    loss = lenient.left.solved.log_evidence - alone.log_evidence
    share = loss / lenient.left.gain
    assert [f.contender.term.candidate.id for f in kept(0.5 * share).found] == ["plate_gain"]
    assert kept(2 * share).found == ()


@dataclass(frozen=True, eq=False)
class Never(Steady):
    """Nothing that anybody would act on."""

    def is_notable(self, estimates):
        return False


@pytest.fixture(scope="module")
def lasting(short_scene):
    """A force at a hand that stays as it is."""
    return at_the_hand(short_scene, [60.0, 0.0, 0.0])


def test_a_free_force_that_stays_the_same_takes_no_named_causes_place(
    lasting, drawn, balance_of_scenes, monkeypatch
):
    """The cause has it at the wrong body; a free one would have it right, and any steady force has a name."""
    plain = balance_of_scenes(drawn(4, lasting, scale=0.5))

    def kept(most_constant):
        monkeypatch.setattr(unexplained, "MOST_CONSTANT", most_constant)
        return keep_beside_the_unknown(plain, select(plain, [Steady("torso")]))

    if_any_may, as_it_is = kept(1.0), kept(MOST_CONSTANT)
    assert if_any_may.found == ()
    assert if_any_may.left.term.candidate.target == "hand_l"
    assert [f.contender.term.candidate.key for f in as_it_is.found] == [("steady", "torso")]


def test_a_free_force_that_takes_back_what_a_named_cause_explains_is_not_told(
    short_scene, drawn, balance_of_scenes, monkeypatch
):
    """Some other weight and a steady pull up are as good as the weight, of whatever size."""
    plain = balance_of_scenes(drawn(4, at_the_hand(short_scene, [0.0, 60.0, 0.0]), scale=0.5))
    (mass,) = SubjectMass.candidates([short_scene])
    monkeypatch.setattr(unexplained, "UNKNOWN_MARGIN_NATS", 1e9)

    def left(most_constant):
        monkeypatch.setattr(unexplained, "MOST_CONSTANT", most_constant)
        return kept_of(plain, mass).left

    assert isinstance(left(1.0).term.candidate, UnknownForce)
    told = left(MOST_CONSTANT)
    assert told is None or not isinstance(told.term.candidate, UnknownForce)


def test_a_steady_force_that_no_named_cause_explains_is_told_beside_it(
    short_scene, lasting, drawn, balance_of_scenes, monkeypatch
):
    """Also once a cause that cannot be was dropped from beside it."""
    missing = lasting + 0.2 * short_scene.plates[0].wrench_ground
    monkeypatch.setattr(unexplained, "UNKNOWN_MARGIN_NATS", 1e9)
    balance = balance_of_scenes(drawn(4, missing, scale=0.5))
    kept = kept_of(balance, PlateGain("plate_1"), Never("torso"))
    assert [f.contender.term.candidate.id for f in kept.found] == ["plate_gain"]
    assert kept.left.term.candidate.target == "hand_l"


def test_where_nothing_is_named_it_is_told_all_the_same(lasting, drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(4, lasting, scale=0.5))
    assert keep_beside_the_unknown(balance, select(balance, [])).left.term.candidate.target == "hand_l"


@dataclass(frozen=True, eq=False)
class Weak(Steady):
    """It pulls a little at most."""

    def is_notable(self, estimates):
        return abs(estimates["force_N"].value) < 10


def test_what_cannot_be_without_the_unknown_is_not_named_beside_it(
    short_scene, swinging, drawn, balance_of_scenes, monkeypatch
):
    """By itself it would have to pull harder than it can; what the unknown leaves to it is little enough."""
    missing = swinging + 0.2 * short_scene.plates[0].wrench_ground
    monkeypatch.setattr(unexplained, "UNKNOWN_MARGIN_NATS", 1e9)
    balance = balance_of_scenes(drawn(4, missing, scale=0.5))
    gain, weak = PlateGain("plate_1"), Weak("hand_l")
    without = balance.solve([balance.term(c, ()) for c in (gain, weak)])
    assert not weak.is_notable(without.estimates(1, balance.scenes))
    kept = kept_of(balance, gain, weak)
    assert [f.contender.term.candidate.id for f in kept.found] == ["plate_gain"]


def test_nothing_is_left_in_what_model_errors_make(drawn, balance_of_scenes):
    for seed in range(3):
        balance = balance_of_scenes(drawn(seed))
        kept = keep_beside_the_unknown(balance, select(balance, []))
        assert kept.left is None


def test_the_force_left_is_worth_its_evidence_and_of_a_size(swinging, drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(4, swinging, scale=0.5))
    left = keep_beside_the_unknown(balance, select(balance, [])).left
    assert left.gain > LEAST_UNKNOWN_NATS
    scene = balance.scenes[0]
    x, _ = left.solved.of(0)
    force = left.term.candidate.force_ground(scene, x)
    true = swinging[:, :3]
    assert np.sqrt(((force - true) ** 2).mean()) < 0.35 * np.sqrt((true**2).mean())


@dataclass(frozen=True, eq=False)
class Checked(Steady):
    """The same, but somebody saw it."""

    about = About("steady", seen_standing=True)


@dataclass(frozen=True, eq=False)
class CheckedNever(Checked):
    """Likewise, but nobody would act on what the unknown leaves of it."""

    def is_notable(self, estimates):
        return False


def test_what_was_seen_otherwise_stays_however_small_the_unknown_makes_it(swinging, drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(4, swinging, scale=0.5))
    kept = kept_of(balance, CheckedNever("hand_l"))
    assert kept.left is not None
    assert [f.contender.term.candidate.key for f in kept.found] == [("steady", "hand_l")]
    assert kept_of(balance, Never("hand_l")).found == ()


def test_what_was_seen_otherwise_stays(swinging, drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(4, swinging, scale=0.5))
    kept = keep_beside_the_unknown(balance, select(balance, [Checked("hand_l")]))
    assert [f.contender.term.candidate.key for f in kept.found] == [("steady", "hand_l")]
