"""Whatever is on no list: it can be what it stands for, and competes with every name."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.cause_decisions import Trail, is_only_tentative
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.clocks import MOST_TRIALS
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain, required_of
from solver.diagnosis.conclusion import conclude
from solver.diagnosis.diagnosis_report import report
from solver.diagnosis.search.contenders import LEAST_UNKNOWN_NATS, TEMPER_NATS, Contender, Found
from solver.diagnosis.search.selection import select
from solver.diagnosis.unmodelled import open_world
from solver.diagnosis.unmodelled.open_world import (
    TIME_HISTORY_KNOTS_S,
    AnyClock,
    AnyPlateFault,
    AnyWrench,
    OpenWorld,
    hold_names,
    outside_the_list,
)
from solver.diagnosis.unmodelled.unexplained import Kept
from tests.solver.diagnosis.causes.conftest import RATE
from tests.solver.diagnosis.named_causes import TimeHistory


def best(columns, wanted):
    """What comes nearest in the span of the columns, frame by frame."""
    A = columns.reshape(-1, columns.shape[2])
    x = np.linalg.lstsq(A, wanted.reshape(-1), rcond=None)[0]
    return (A @ x).reshape(wanted.shape)


def about(wrench, point):
    """The same with its moment about a point, written with a loop over frames."""
    return np.array([[*w[:3], *(w[3:] - np.cross(point, w[:3]))] for w in wrench])


def test_a_plate_fault_may_be_any_map_of_its_load_and_any_zero(short_scene):
    """A plate turned by a quarter about its middle, of half gain, tared with a load on it."""
    plate = short_scene.plates[0]
    load = about(required_of(plate, short_scene), plate.centre_ground)
    R = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    wrong = 0.5 * np.concatenate([load[:, :3] @ R.T, load[:, 3:] @ R.T], axis=1)
    wrong[plate.loaded] -= (10.0, 300.0, -5.0, 4.0, 0.0, 8.0)
    fault_ground = about(np.where(plate.loaded[:, None], load - wrong, 0.0), -plate.centre_ground)
    signature = AnyPlateFault("plate_1").signature(short_scene, (0.05,))
    assert signature.columns.shape[2] == 42
    np.testing.assert_allclose(best(signature.columns, fault_ground), fault_ground, atol=1e-6)
    assert not signature.columns[~plate.loaded].any()
    assert AnyPlateFault("plate_9").signature(short_scene, (0.05,)) is None


def test_any_wrench_may_be_any_steady_or_slow_one(short_scene):
    steady = np.broadcast_to((30.0, -100.0, 12.0, 5.0, -3.0, 9.0), (short_scene.frames, 6))
    ground = steady.copy()
    ground[:, 3:] += np.cross(short_scene.com_ground, steady[:, :3])
    own = AnyWrench("", "walk").signature(short_scene, (0.2,)).columns
    np.testing.assert_allclose(best(own, ground), ground, atol=1e-6)
    swing = ground * np.sin(2 * np.pi * 0.5 * short_scene.times)[:, None]
    swing[:, 3:] = np.cross(short_scene.com_ground, swing[:, :3])
    slow = AnyWrench("", "walk", TIME_HISTORY_KNOTS_S).signature(short_scene, (0.2,)).columns
    assert np.abs(best(slow, swing) - swing).max() < 2.0
    assert np.abs(best(own, swing) - swing).max() > 20.0


def test_a_clock_is_how_fast_the_recorded_wrench_changes(short_scene):
    late = AnyClock("walk", "walk").signature(short_scene, (0.05,))
    shifted = short_scene.retime(lambda times: times + 0.001) - short_scene.measured_ground
    inner = slice(5, -5)
    of_1_ms = 0.001 * late.columns[inner, :, 0]
    assert np.abs(of_1_ms - shifted[inner]).max() < 0.15 * np.abs(shifted[inner]).max()
    assert late.prior_std == pytest.approx([0.005])


def test_the_family_is_small_and_each_touches_something(short_scene):
    family = outside_the_list([short_scene])
    assert 5 <= len(family) <= 12
    assert {one.kind for one in family} >= {"body", "plate"}  # clocks have names
    for one in family:
        signature = one.signature(short_scene, (0.05,))
        assert signature.columns.any()
        assert len(signature.prior_std) == signature.columns.shape[2]
    assert short_scene.rate == RATE


def test_clocks_that_no_entry_parts_are_of_unknown_time(short_scene):
    """A plate in one of several trials; a trial among more than have clocks of their own."""

    def times(count):
        scenes = [replace(short_scene, name=f"trial {k}") for k in range(count)]
        return [one.target for one in outside_the_list(scenes) if one.kind == "time"]

    assert times(1) == []
    assert all(" in trial " in target for target in times(2))
    assert len(times(2)) >= 4
    assert "trial 0" in times(MOST_TRIALS + 1)


NAMES = 60


@pytest.fixture(scope="module")
def few(short_scene):
    return [PlateGain("plate_1"), PlateGain("plate_2"), *PlatePosition.candidates([short_scene])]


@pytest.fixture(scope="module")
def turned(short_scene, drawn, balance_of_scenes):
    """The second plate's forces come from a plate that is turned by a quarter: on no list of these few."""
    plate = short_scene.plates[1]
    force = plate.wrench_ground[:, :3]
    there = np.stack([force[:, 2], force[:, 1], -force[:, 0]], axis=1)
    missing = np.zeros((short_scene.frames, 6))
    missing[:, :3] = 0.5 * (force - there) + 0.3 * force
    missing[:, 3:] = np.cross(plate.centre_ground, missing[:, :3])
    return balance_of_scenes(drawn(2, missing, scale=0.5))


def held_of(balance, selection):
    return hold_names(balance, Kept(selection.solved, selection.found, None), NAMES, selection.trail)


def test_a_right_name_stays_sure(short_scene, drawn, balance_of_scenes, few):
    balance = balance_of_scenes(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    selection = select(balance, few)
    kept = held_of(balance, selection)
    assert [f.contender.term.candidate.key for f in kept.found] == [("plate_gain", "plate_2")]
    (standing,) = kept.standings
    assert standing.confidence > 0.9
    assert standing.confidence + standing.outside <= 1.0 + 1e-9
    assert kept.unknown is None


def test_the_nearest_wrong_name_gives_way_to_the_plate_it_is_about(turned, few):
    selection = select(turned, few)
    kept = held_of(turned, selection)
    assert kept.unknown is not None
    assert (kept.unknown.cause.kind, kept.unknown.cause.target) == ("plate", "plate_2")
    assert all(s.behind < 1.0 for s in kept.standings)
    answer = report(conclude(turned, selection)).as_json()
    assert answer["verdict"] == "unexplained"
    off = answer["remaining"]["off_the_list"]
    assert (off["touches"], off["target"]) == ("plate", "plate_2")
    assert off["rms_force_N"] > 50.0
    assert "plate_2" in off["sentence"]
    assert not [e for e in answer["effects"] if e["confidence"] > 0.5]


def test_what_is_too_small_to_look_for_is_no_evidence_that_something_is_wrong(turned, few, monkeypatch):
    selection = select(turned, [])
    assert held_of(turned, selection).unknown_nats > LEAST_UNKNOWN_NATS
    monkeypatch.setattr(open_world, "LEAST_UNKNOWN_SHARE", 0.9)  # of body weight
    kept = held_of(turned, selection)
    assert kept.unknown is None
    assert kept.unknown_nats == -np.inf


def test_nothing_is_told_where_nothing_is_wrong(drawn, balance_of_scenes, few):
    for seed in (11, 12, 13):
        balance = balance_of_scenes(drawn(seed))
        selection = select(balance, few)
        kept = held_of(balance, selection)
        assert kept.unknown is None


def test_the_evidence_of_an_unknown_is_that_over_its_sizes(drawn, balance_of_scenes):
    """Against a dense Gaussian of every size, and their mixture."""
    balance = balance_of_scenes(drawn(3))
    null = balance.solve([])
    world = OpenWorld(balance)
    found = min(world.beside([], null), key=lambda u: u.likeliest.terms[-1].columns.shape[1])
    columns = found.likeliest.terms[-1].columns
    noise_scale = found.likeliest.noise_scale
    K = noise_scale.covariance
    log = []
    base = found.likeliest.terms[-1].prior_std / found.likeliest.terms[-1].eta[0]
    for size in (0.01, 0.05, 0.2, 0.8):
        whole = K + columns @ np.diag((size * base) ** 2) @ columns.T
        sign, half = np.linalg.slogdet(whole)
        assert sign > 0
        log.append(-0.5 * balance.residual @ np.linalg.solve(whole, balance.residual) - 0.5 * half)
    mixed = np.log(np.exp(np.array(log) - max(log)) @ (0.4, 0.3, 0.2, 0.1)) + max(log)
    without = -0.5 * balance.residual @ np.linalg.solve(K, balance.residual) - 0.5 * np.linalg.slogdet(K)[1]
    at_noise_scale = balance.solve_at([], noise_scale).log_evidence
    assert found.log_evidence - at_noise_scale == pytest.approx(mixed - without, abs=1e-6)


@dataclass(frozen=True, eq=False)
class Standing(TimeHistory):
    """A foot that is seen to stand where nothing measures."""

    about = About("standing", seen_standing=True)
    id = "standing"


@pytest.mark.parametrize(("cause", "kept"), [(TimeHistory, False), (Standing, True)])
def test_no_force_elsewhere_takes_the_place_of_a_foot_that_is_seen_to_stand(
    short_scene, drawn, balance_of_scenes, cause, kept
):
    """Both say of a force that it is half a metre from where it is; the balance denies it of both."""
    force = np.tile([0.0, 250.0, 0.0], (short_scene.frames, 1))
    there = np.concatenate([force, np.cross(short_scene.com_ground, force)], axis=1)
    aside = short_scene.com_ground + np.array([0.5, 0.0, 0.0])
    said = np.concatenate([force, np.cross(aside, force)], axis=1)
    balance = balance_of_scenes(drawn(4, there, scale=0.3))
    null, solved = balance.solve([]), balance.solve([balance.term(cause("calcn_r", said), ())])
    contender = Contender(solved.terms[0], solved, solved.log_evidence - null.log_evidence)
    names = Kept(solved, (Found(contender, 1.0, ()),), None)
    assert bool(hold_names(balance, names, NAMES, Trail()).found) == kept


@pytest.mark.parametrize(("sideways", "share"), [(0.0, 0.0), (0.009, 0.0), (0.011, 0.03)])
def test_evidence_errs_unless_two_causes_explain_the_same(
    short_scene, drawn, balance_of_scenes, sideways, share
):
    """11 nats of hundreds part no load from a mass; but they part one clock from one for each trial."""
    up, aside = (np.tile(250.0 * np.array(axis), (short_scene.frames, 1)) for axis in np.eye(3)[1:])
    there, elsewhere = (
        np.concatenate([force, np.cross(short_scene.com_ground, force)], axis=1)
        for force in (up, up + sideways * aside)
    )
    balance = balance_of_scenes(drawn(4, there, scale=0.3))
    null, solved = balance.solve([]), balance.solve([balance.term(Standing("calcn_r", there), ())])
    one = Contender(solved.terms[0], solved, solved.log_evidence - null.log_evidence)
    beside = balance.solve([balance.term(Standing("calcn_l", elsewhere), ())])
    rival = Contender(beside.terms[0], beside, one.gain - 11.0)
    own, others = (s.terms[0].columns @ s.x for s in (solved, beside))
    whitened = np.linalg.solve(np.linalg.cholesky(solved.noise_scale.covariance), own - others)
    assert (whitened @ whitened / 2 < 3.0) == (share == 0.0)
    names = Kept(solved, (Found(one, 1.0, (rival,)),), None)
    (standing,) = hold_names(balance, names, NAMES, Trail()).standings
    assert one.gain > 150.0
    temper = 3.0 + share * one.gain
    expected = (1 - standing.outside) / (1 + np.exp(-11.0 / temper))
    assert standing.confidence == pytest.approx(expected, abs=1e-3)
    assert standing.rivals[0].temper == pytest.approx(temper)


@pytest.mark.parametrize("alike", [True, False])
def test_what_is_likelier_wrong_than_right_is_only_tentative_unless_it_is_one_class(
    short_scene, drawn, balance_of_scenes, alike
):
    """Three explain as much. Where all leave one trace their class is likely; else each is a guess."""
    up = np.tile([0.0, 20.0, 0.0], (short_scene.frames, 1))
    there = np.concatenate([up, np.cross(short_scene.com_ground, up)], axis=1)
    swinging = there * np.sin(12 * short_scene.times)[:, None]
    balance = balance_of_scenes(drawn(4, there, scale=0.3))
    null, solved = balance.solve([]), balance.solve([balance.term(TimeHistory("pelvis", there), ())])
    one = Contender(solved.terms[0], solved, solved.log_evidence - null.log_evidence)
    others = [
        balance.solve([balance.term(TimeHistory(b, there if alike else swinging), ())]) for b in ("a", "b")
    ]
    rivals = tuple(Contender(other.terms[0], other, one.gain) for other in others)
    (standing,) = hold_names(
        balance, Kept(solved, (Found(one, 1.0, rivals),), None), NAMES, Trail()
    ).standings
    assert standing.confidence == pytest.approx((1 - standing.outside) / 3, abs=0.01)
    assert [rival.share for rival in standing.rivals] == pytest.approx([standing.confidence] * 2)
    assert standing.in_its_class == pytest.approx((3 if alike else 1) * standing.confidence)
    candidate = one.term.candidate
    assert is_only_tentative(candidate, standing.in_its_class) == (not alike)
    assert not is_only_tentative(Standing("calcn_r", there), standing.in_its_class)


@dataclass(frozen=True, eq=False)
class Rare(TimeHistory):
    """Rare, and changes next to nothing; something else than the balance may show it."""

    id = "rare"
    about = About("rare", odds_against=3.0)
    nats: float = 0.0

    @property
    def seen_elsewhere(self):
        return self.nats


@pytest.mark.parametrize(("nats", "kept"), [(0.0, False), (8.0, True)])
def test_what_is_seen_elsewhere_stands_beside_an_unknown_that_does_not_explain_it(turned, nats, kept):
    """A plate is turned, which is on no list; that explains nothing that was seen outside the balance."""
    nothing = np.zeros((turned.scenes[0].frames, 6))
    null, solved = turned.solve([]), turned.solve([turned.term(Rare("all", nothing, nats=nats), ())])
    contender = Contender(solved.terms[0], solved, solved.log_evidence - null.log_evidence)
    result = hold_names(turned, Kept(solved, (Found(contender, 1.0, ()),), None), NAMES, Trail())
    assert bool(result.found) == kept
    assert result.unknown.cause.target == "plate_2"
    if kept:
        assert 0.5 < result.standings[0].confidence < 1 / (1 + np.exp(-nats / TEMPER_NATS))
