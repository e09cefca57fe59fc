from dataclasses import replace

import numpy as np
import pytest

from solver.kinematics.unnamed.landmark_mixture import landmark_mixture
from solver.kinematics.unnamed.whole_recording import FORWARDS_LOG_ODDS, Attachment, Followed, forwards


@pytest.fixture
def ahead():
    """The default body moving one metre along its own front."""
    mixture = landmark_mixture()
    q = np.tile(mixture.skeleton.default_q, (10, 1))
    q[:, mixture.skeleton.dofs.index("pelvis_tx")] = np.linspace(0, 1, 10)
    nothing = np.zeros((0, len(mixture.landmarks)))
    empty = Attachment(nothing, np.zeros(0), np.zeros((0, len(mixture.skeleton.bodies), 3)), np.zeros((0, 1)))
    return Followed(q, 1.0, True, empty, 0.0), mixture


def test_walking_ahead_speaks_for_the_front_and_walking_back_against_it(ahead):
    followed, mixture = ahead
    one = np.zeros(10, dtype=int)
    most = FORWARDS_LOG_ODDS
    assert forwards(followed, one, mixture) == pytest.approx(most)
    assert forwards(replace(followed, q=followed.q[::-1]), one, mixture) == pytest.approx(-most)


def test_who_stays_says_nothing_and_the_way_between_recordings_does_not_count(ahead):
    followed, mixture = ahead
    assert forwards(replace(followed, q=followed.q[:3]), np.zeros(3, dtype=int), mixture) == 0.0
    assert forwards(followed, np.arange(10), mixture) == 0.0
