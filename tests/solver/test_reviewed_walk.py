"""A real walk, solved with what a person flagged: one foot's force in double support must not be used."""

import numpy as np
import pytest

from solver.capture.subject import open_subject
from solver.contact.wrenches import FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.pipeline import solve
from solver.settings import Settings

pytestmark = pytest.mark.real

FLAGGED = slice(88, 98)  # both feet stand on a plate each
REVIEW = ((FLAGGED.start, FLAGGED.stop, "calcn_r", "forceDiscrepancy"),)


@pytest.fixture(scope="module")
def walk(real_data):
    """The fit of the trial, whose review.json flags frames 0 to 60 and 175 to 237."""
    subject = open_subject(real_data / "walk_rajagopal2015")
    return solve(subject, Settings(), trials=["walk"], reviews={"walk": REVIEW})


def test_the_persons_review_alone_decides(walk):
    (trial,) = walk.trials
    assert trial.mask.source == "review"
    assert trial.mask.reasons == REVIEW
    assert not trial.mask.all_feet[FLAGGED].any()
    assert trial.mask.all_feet.sum() == trial.motion.frames - (FLAGGED.stop - FLAGGED.start)
    assert not trial.dynamics.used[FLAGGED].any()
    assert trial.dynamics.used[[30, 87, 98, 200]].all()


def test_the_other_foots_measured_force_still_enters_the_torques(walk):
    (trial,) = walk.trials
    settings = Settings()
    neither = FrameMask(np.zeros_like(trial.mask.counts))
    swinging = inverse_dynamics(
        walk.skeleton, trial.dynamics.motion, trial.contacts, neither, settings.dynamics
    ).joint_torques
    difference = np.abs(trial.dynamics.joint_torques - swinging)[FLAGGED]
    right, left = (walk.skeleton.dofs.index(f"hip_flexion_{side}") for side in "rl")
    np.testing.assert_allclose(difference[:, right], 0, atol=1e-9)
    assert difference[:, left].max() > 30  # [N·m] some 500 N on the heel, a decimetre before the hip
