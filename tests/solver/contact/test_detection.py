"""Detection on a walk whose truth is known, and on recordings from which forces were hidden."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks.detection import KINDS, Recording, Score, case_of, evaluate
from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.plates.conditioning import condition
from solver.contact.assignment import assign
from solver.contact.detected_ranges import missing_force, sure_ranges
from solver.contact.detection import detect
from solver.contact.detection_settings import DetectionSettings
from solver.contact.settings import ContactSettings
from solver.fitting.fit_result import TrialFit
from solver.fitting.review_stage import propose
from solver.fitting.settings import Settings
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.simulate.laboratory import MeasurementSettings, Plate, measure, plates_under, stances_within
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.skeleton.forward import body_poses
from solver.skeleton.scaling import with_mass

SPAN = (0.0, 1.6)  # [s]
FEET = ("calcn_r", "calcn_l")
MIDDLE, FOOT = 2, "calcn_l"  # the third stance of the walk is whole, and the left foot's
JITTER = 0.0005  # [rad] at 100 Hz: what inverse kinematics leaves of markers' noise, up to 1 mrad


@dataclass
class Walk:
    """A person walking over plates; what is recorded differs from test to test."""

    trial: SyntheticTrial
    motion: Motion

    @property
    def weight(self) -> float:
        return self.trial.body.skeleton.mass * 9.80665

    @property
    def plates(self) -> tuple[Plate, ...]:
        return plates_under(self.trial.contacts, SPAN)

    def recorded(self, plates: tuple[Plate, ...]) -> tuple[ForcePlate, ...]:
        capture: Capture = measure(self.trial, plates, (), MeasurementSettings(), np.random.default_rng(2))
        return capture.plates

    def proposals(self, recorded: tuple[ForcePlate, ...]):
        skeleton = self.trial.body.skeleton
        contacts = assign(
            [condition(plate, self.motion.times) for plate in recorded],
            *body_poses(skeleton, self.motion.q),
            skeleton=skeleton,
            foot_bodies=FEET,
            times=self.motion.times,
            settings=ContactSettings(),
        )
        found = detect(skeleton, self.motion, contacts, recorded, settings=DetectionSettings())
        return [p for p in found if p.confidence >= DetectionSettings().confidence]

    def lost(self, keep: tuple[Plate, ...]) -> np.ndarray:
        """Frames × feet on which plates other than these measured more than 20 N."""
        reactions = self.trial.reactions(self.motion.times)
        off = ~np.any([plate.holds(reactions.cop_ground) for plate in keep], axis=0)
        return off & (reactions.wrench_ground[:, :, 1] > 20.0)


@pytest.fixture(scope="module")
def walk() -> Walk:
    body_rng, motion_rng, noise_rng = np.random.default_rng(5).spawn(3)
    scenario = Scenario("walk", "walk", duration=SPAN[1])
    trial = simulate_trial(scenario, body_of(Person(70.0, 1.74), body_rng), motion_rng)
    frames = trial.frames(100.0)
    return Walk(trial, replace(frames, q=frames.q + JITTER * noise_rng.standard_normal(frames.q.shape)))


def the_one(proposals):
    assert len(proposals) == 1, [(p.range, p.foot, p.reason) for p in proposals]
    return proposals[0]


def assert_covers(proposal, lost):
    """All frames of the loss but two at each border, and no more than five beyond it."""
    frames = np.flatnonzero(lost)
    start, end = proposal.range
    assert frames[0] - 5 <= start <= frames[0] + 2
    assert frames[-1] - 1 <= end <= frames[-1] + 6


def test_a_walk_measured_whole_gets_no_proposal(walk):
    assert walk.proposals(walk.recorded(walk.plates)) == []


def test_a_step_beside_the_plates(walk):
    plates = tuple(p for k, p in enumerate(walk.plates) if k != MIDDLE)
    found = the_one(walk.proposals(walk.recorded(plates)))
    assert (found.foot, found.reason) == (FOOT, "notOverForcePlate")
    assert found.evidence["share_off_plates"] > 0.9
    assert found.confidence > 0.95
    assert_covers(found, walk.lost(plates)[:, FEET.index(FOOT)])


def test_a_plate_that_stays_silent_under_a_step(walk):
    recorded = list(walk.recorded(walk.plates))
    recorded[MIDDLE] = silent(recorded[MIDDLE])
    found = the_one(walk.proposals(tuple(recorded)))
    assert (found.foot, found.reason) == (FOOT, "footContactDetectedButNoForce")
    assert found.evidence["share_off_plates"] == 0.0


def test_a_step_beside_plates_whose_corners_nobody_knows(walk):
    plates = tuple(p for k, p in enumerate(walk.plates) if k != MIDDLE)
    recorded = tuple(replace(p, corners_ground=None) for p in walk.recorded(plates))
    found = the_one(walk.proposals(recorded))
    assert (found.foot, found.reason) == (FOOT, "footContactDetectedButNoForce")
    assert "share_off_plates" not in found.evidence


def test_a_foot_that_rolls_over_the_plates_edge(walk):
    """The plate ends under the middle of the foot: the late part of the stance is lost."""
    stance = stances_within(walk.trial.contacts, SPAN)[MIDDLE]
    plates = list(walk.plates)
    centre = plates[MIDDLE].centre
    plates[MIDDLE] = replace(plates[MIDDLE], centre=(centre[0] - plates[MIDDLE].half_length, centre[1]))
    lost = walk.lost(tuple(plates))[:, FEET.index(FOOT)]
    assert 0.1 < lost.sum() / 100 < stance.end - stance.start - 0.1
    found = the_one(walk.proposals(walk.recorded(tuple(plates))))
    assert found.foot == FOOT
    assert_covers(found, lost)


def test_a_foot_half_on_the_plate(walk):
    recorded = list(walk.recorded(walk.plates))
    recorded[MIDDLE] = scaled(recorded[MIDDLE], 0.6)
    found = the_one(walk.proposals(tuple(recorded)))
    assert (found.foot, found.reason) == (FOOT, "forceDiscrepancy")
    assert found.evidence["missing_share"] == pytest.approx(0.4, abs=0.05)
    loaded = np.flatnonzero(walk.lost(plates_but(walk.plates, MIDDLE))[:, FEET.index(FOOT)])
    assert abs(found.range[0] - loaded[0]) <= 2  # as far as the filter spreads the load, and no farther
    assert abs(found.range[1] - 1 - loaded[-1]) <= 2


def test_pelvis_markers_that_blink_are_no_missing_force(walk):
    """For 60 ms every other frame has the pelvis 3 cm away, as where two of its markers come and go."""
    blinking = replace(walk, motion=_blinking(walk, MIDDLE))
    assert blinking.proposals(walk.recorded(walk.plates)) == []


def test_a_step_beside_the_plates_while_they_blink(walk):
    plates = plates_but(walk.plates, MIDDLE)
    blinking = replace(walk, motion=_blinking(walk, MIDDLE))
    found = the_one(blinking.proposals(walk.recorded(plates)))
    assert found.foot == FOOT
    assert_covers(found, walk.lost(plates)[:, FEET.index(FOOT)])


def plates_but(plates, index):
    return tuple(p for k, p in enumerate(plates) if k != index)


def _blinking(walk, stance):
    span = stances_within(walk.trial.contacts, SPAN)[stance]
    first = round(100 * (0.5 * span.start + 0.5 * span.end))
    root = [walk.motion.dofs.index(f"pelvis_t{axis}") for axis in "xyz"]
    q = walk.motion.q.copy()
    q[np.ix_(range(first, first + 6, 2), root)] += 0.03
    return replace(walk.motion, q=q)


def test_a_plate_that_shows_too_much(walk):
    recorded = list(walk.recorded(walk.plates))
    recorded[MIDDLE] = scaled(recorded[MIDDLE], 1.5)
    found = the_one(walk.proposals(tuple(recorded)))
    assert (found.foot, found.reason) == (FOOT, "forceDiscrepancy")
    assert found.evidence["missing_share"] == pytest.approx(-0.5, abs=0.1)


def test_a_wrong_mass_is_no_missing_force(walk):
    """All forces 6 % too small: the scale or the plates are off, and no foot is."""
    recorded = tuple(scaled(plate, 0.94) for plate in walk.recorded(walk.plates))
    assert walk.proposals(recorded) == []


def test_late_forces_are_no_missing_forces(walk):
    late = tuple(replace(p, start_time=p.start_time + 0.008) for p in walk.recorded(walk.plates))
    assert [p for p in walk.proposals(late) if p.reason != "hasNoForcePlateData"] == []


def test_two_feet_on_one_plate(walk):
    joined = Plate((0.0, 0.0), 3.0, 2.0)
    found = walk.proposals(walk.recorded((joined,)))
    double = np.minimum(*walk.trial.reactions(walk.motion.times).wrench_ground[:, :, 1].T) > 100.0
    flagged = missing_force(found, FEET, walk.motion.frames).all(axis=1)
    assert flagged[double].all()
    assert {p.reason for p in found} == {"copOutsideConvexFootError"}


def test_a_recording_of_forces_that_ends_early(walk):
    short = tuple(cut(plate, samples=1000) for plate in walk.recorded(walk.plates))
    found = [p for p in walk.proposals(short) if p.reason == "hasNoForcePlateData"]
    assert [(p.range, p.foot) for p in found] == [((101, 161), None)]


def test_no_plates_at_all(walk):
    found = the_one(detect(walk.trial.body.skeleton, walk.motion, None, (), settings=DetectionSettings()))
    assert (found.range, found.foot) == ((0, walk.motion.frames), None)
    assert (found.reason, found.confidence) == ("hasNoForcePlateData", 1.0)


def test_proposals_become_a_mask_by_foot_and_confidence(walk):
    plates = tuple(p for k, p in enumerate(walk.plates) if k != MIDDLE)
    found = walk.proposals(walk.recorded(plates))
    mask = missing_force(found, FEET, walk.motion.frames)
    assert mask[slice(*found[0].range), 1].all()
    assert not mask[:, 0].any()
    assert not missing_force(found, FEET, walk.motion.frames, confidence=1.01).any()


def silent(plate: ForcePlate) -> ForcePlate:
    return replace(scaled(plate, 0.0), cop_ground=np.full_like(plate.cop_ground, np.nan))


def scaled(plate: ForcePlate, by: float) -> ForcePlate:
    return replace(plate, force_ground=by * plate.force_ground, moment_ground=by * plate.moment_ground)


def cut(plate: ForcePlate, samples: int) -> ForcePlate:
    part = slice(samples)
    return replace(
        plate,
        force_ground=plate.force_ground[part],
        moment_ground=plate.moment_ground[part],
        cop_ground=plate.cop_ground[part],
    )


# ---- recordings -------------------------------------------------------------------------------------------

WHOLE = (
    Recording("walk_gait2354_subject01", "walk1"),
    Recording("run_treadmill_hamner2013_subject04", "run400"),
    Recording("opencap_subject4", "squats1"),
)


@pytest.fixture(scope="module", params=WHOLE, ids=lambda recording: recording.trial)
def case(request, real_data):
    return case_of(request.param)


@pytest.mark.real
def test_recordings_with_all_forces_get_no_proposal(case):
    assert not case.proposed(case.plates).any()


@pytest.mark.real
@pytest.mark.parametrize("kind", KINDS)
def test_hidden_forces_are_found(case, kind):
    """Seeds fixed; the bars for all seeds and recordings are those of the benchmark."""
    total = sum((evaluate(case, KINDS[kind], seed)[0] for seed in (0, 1)), Score())
    if not total.found + total.missed:
        pytest.skip("no double support in running")
    assert total.recall >= (0.998 if kind == "whole stances" else 0.95)
    assert total.precision >= (0.90 if kind == "whole stances" else 0.85)


@pytest.mark.real
def test_a_chair_is_no_foot(real_data):
    """Sit to stand on a chair that no plate measures: what is missing presses behind the resting feet."""
    case = case_of(Recording("opencap_subject4", "STS1"))
    sure = [p for p in case.proposals(case.plates) if p.confidence >= 0.5]
    assert {(p.foot, p.reason) for p in sure} == {(None, "unmeasuredExternalForceDetected")}
    mask = missing_force(sure, FEET, case.trial.motion.frames).all(axis=1)
    total = np.sum([plate.force_ground[:, 1] for plate in case.plates], axis=0)
    assert mask[total[: len(mask)] < 60.0].all()  # seated: a tenth of the body's weight
    assert not mask[150:240].any()  # standing between two of them


@pytest.mark.real
def test_standing_on_a_box_agrees_with_the_reviewer(real_data):
    case = case_of(Recording("opencap_reviewed", "DJ1"))
    person = case.trial.capture.imported_missing_force
    ours = case.proposed(case.plates).any(axis=1)
    assert (person != ours).sum() <= 4


@pytest.mark.parametrize("share", [0.75, 1.35])
def test_a_mass_that_is_only_a_guess_takes_no_force_away(walk, share):
    """What nobody weighed is as uncertain to detection; as sure as an entered mass, 1.35 cost every step."""
    guess = with_mass(walk.trial.body.skeleton, share * walk.trial.body.skeleton.mass)
    recorded = walk.recorded(walk.plates)
    contacts = assign(
        [condition(plate, walk.motion.times) for plate in recorded],
        *body_poses(guess, walk.motion.q),
        skeleton=guess,
        foot_bodies=FEET,
        times=walk.motion.times,
        settings=ContactSettings(),
    )
    nothing = np.zeros((walk.motion.frames, 1, 3))
    markers = Markers(("M",), nothing, walk.motion.rate)
    errors = MarkerErrors(("M",), nothing[:, :, 0])
    fit = TrialFit(Capture("walk", markers, recorded), walk.motion, errors, nothing, contacts)
    judged = propose(fit, guess, Settings(), guessed_within=0.2)
    assert not sure_ranges(judged.proposals, Settings().detection.confidence)
