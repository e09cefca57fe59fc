import numpy as np

from solver.kinematics.unnamed.landmark_mixture import landmark_mixture
from solver.kinematics.unnamed.single_frame import ABOVE_SOLE_M, HEADINGS, first_guesses, postures


def test_guesses_stand_on_the_ground_below_the_cloud_in_every_heading():
    mixture = landmark_mixture()
    points = np.array([[5.0, 0.13, 2.0], [5.2, 1.0, 2.0], [5.1, 1.8, 2.1]])
    guesses = first_guesses(points, mixture)
    upright = guesses.some(np.arange(0, len(guesses.q), len(postures(mixture))))
    x = mixture.kinematics.markers(mixture.kinematics.poses(upright.q)) * upright.size[:, None, None]
    assert np.abs(x[:, :, 1].min(axis=1) - 0.13).max() < 2 * ABOVE_SOLE_M
    R = mixture.kinematics.poses(upright.q).R_ground_body[:, mixture.root.body]
    headings = np.unique(np.round(np.degrees(np.arctan2(R[:, 2, 0], R[:, 0, 0])) % 360))
    assert len(headings) == HEADINGS
    assert guesses.arms.sum() * 2 == len(guesses.arms)


def test_a_small_person_gets_a_small_guess():
    mixture = landmark_mixture()
    child = np.array([[0.0, 0.0, 0.0], [0.0, 1.15, 0.0]])
    assert first_guesses(child, mixture).size.min() < 0.75
