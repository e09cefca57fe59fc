"""A real walk, solved with what a person flagged: one foot's force in double support must not be used."""

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.contact.mask import OUTSIDE_RANGES
from solver.contact.wrenches import FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from tests.conftest import NO_HELD_OUT
from tests.flagged import flagged

pytestmark = pytest.mark.real

FLAGGED = slice(88, 98)  # both feet stand on a plate each
REVIEW = ((FLAGGED.start, FLAGGED.stop, "calcn_r", "forceDiscrepancy"),)
OUTSIDE = ((0, 45, None, OUTSIDE_RANGES), (201, 238, None, OUTSIDE_RANGES))  # trialRanges: 0.45 to 2 s


@pytest.fixture(scope="module")
def walk(real_data):
    """The fit of the trial, whose review.json flags frames 0 to 60 and 175 to 237."""
    subject = open_subject(real_data / "walk_rajagopal2015")
    return solve(subject, NO_HELD_OUT, trials=["walk"], reviews={"walk": flagged(*REVIEW)})


def test_the_person_decides_on_their_frames_and_the_imported_review_on_the_others(walk):
    (trial,) = walk.trials
    assert trial.mask.source == "review + review.json"
    imported = [(0, 61, None, "manualReview"), (175, 238, None, "manualReview")]
    assert sorted(trial.mask.reasons[:2]) == sorted((OUTSIDE[0], imported[0]))
    assert trial.mask.reasons[2:] == (*REVIEW, imported[1], OUTSIDE[1])
    assert not trial.mask.all_feet[FLAGGED].any()
    assert not trial.mask.all_feet[:61].any()
    assert not trial.mask.all_feet[175:].any()
    assert trial.mask.all_feet[61:175].sum() == 175 - 61 - (FLAGGED.stop - FLAGGED.start)
    assert not trial.dynamics.used[FLAGGED].any()
    assert trial.dynamics.used[[61, 87, 98, 174]].all()


def test_the_other_foots_measured_force_still_enters_the_torques(walk):
    (trial,) = walk.trials
    settings = Settings().dynamics
    motion, contacts = trial.dynamics.motion, trial.contacts
    neither = FrameMask(np.zeros_like(trial.mask.counts))
    with_one = inverse_dynamics(walk.skeleton, motion, contacts, trial.mask, settings).joint_torques
    swinging = inverse_dynamics(walk.skeleton, motion, contacts, neither, settings).joint_torques
    difference = np.abs(with_one - swinging)[FLAGGED]
    right, left = (walk.skeleton.dofs.index(f"hip_flexion_{side}") for side in "rl")
    np.testing.assert_allclose(difference[:, right], 0, atol=1e-9)
    assert difference[:, left].max() > 30  # [N·m] some 500 N on the heel, a decimetre before the hip
    np.testing.assert_allclose(
        trial.dynamics.joint_torques[FLAGGED, left], with_one[FLAGGED, left], atol=1e-9
    )


@pytest.fixture(scope="module")
def walk_on_plates(real_data):
    """Only frames on which both feet are on plates or in the air count, but for the flagged foot."""
    subject = open_subject(real_data / "walk_rajagopal2015")
    off_plates = [(0, 61, None, "notOverForcePlate"), (175, 238, None, "notOverForcePlate")]
    return solve(subject, NO_HELD_OUT, reviews={"walk": flagged(*off_plates, *REVIEW)})


def test_the_flagged_foot_gets_what_the_motion_demands_of_it(walk_on_plates):
    """Its plate did measure; the flag only says not to use it, so the plate is an independent check."""
    (trial,) = walk_on_plates.trials
    motion, contacts, settings = trial.dynamics.motion, trial.contacts, Settings().dynamics
    leg = [
        walk_on_plates.skeleton.dofs.index(f"{name}_r")
        for name in ("hip_flexion", "knee_angle", "ankle_angle")
    ]

    def with_measured(mask):
        found = inverse_dynamics(walk_on_plates.skeleton, motion, contacts, mask, settings)
        return found.joint_torques[FLAGGED][:, leg]

    right = contacts.foot_bodies.index("calcn_r")
    assert trial.dynamics.wrench_is_predicted[FLAGGED, right].all()
    assert not trial.dynamics.wrench_is_predicted[FLAGGED, 1 - right].any()
    direct_check = with_measured(FrameMask(np.ones_like(trial.mask.counts)))
    ours = np.abs(trial.dynamics.joint_torques[FLAGGED][:, leg] - direct_check).max()
    nothing = np.abs(with_measured(trial.mask) - direct_check).max()
    assert ours < 0.5 * nothing
