import numpy as np
import pytest

from solver.kinematics.unnamed.landmark_mixture import landmark_mixture
from solver.kinematics.unnamed.single_frame import lay_over, of_size


def test_the_best_guess_puts_most_markers_on_their_bodies(walker):
    markers, places = walker
    mixture = landmark_mixture()
    points = markers.positions_ground[15]
    allowed = np.ones((len(points), len(mixture.landmarks)), dtype=bool)
    laid = lay_over(points, allowed, mixture, (0.0, 0.1))
    assert (np.diff(laid.log_likelihood) <= 0).all()
    bodies = (laid.share[0] @ mixture.of_body).argmax(axis=1)
    names = [mixture.skeleton.body_names[b] for b in bodies]
    assert (
        np.mean([name == places[label].body for name, label in zip(names, markers.names, strict=True)]) > 0.6
    )
    assert (laid.share.sum(axis=2) <= 1 + 1e-9).all()


def test_a_size_is_judged_by_its_prior_when_no_marker_is_there():
    sizes = np.array([0.8, 1.0, 1.2])
    assert of_size(sizes, 0, (0.0, 0.1)).argmax() == 1
    assert of_size(sizes, 0, (0.0, 0.1))[2] == pytest.approx(-0.5 * (np.log(1.2) / 0.1) ** 2)
