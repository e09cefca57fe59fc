import numpy as np
import pytest

from solver.kinematics.unnamed.landmark_mixture import landmark_mixture


@pytest.fixture(scope="module")
def mixture():
    return landmark_mixture()


def share_of(mixture, *names):
    """Markers that are certainly at these landmarks."""
    order = [mark.name for mark in mixture.landmarks]
    share = np.zeros((len(names), len(order)))
    share[np.arange(len(names)), [order.index(name) for name in names]] = 1.0
    return share, order


def test_weights_are_probabilities_whichever_limbs_are_marked(mixture):
    for arms, hands in ((True, True), (True, False), (False, False)):
        assert np.exp(mixture.log_weight(arms, hands)).sum() == pytest.approx(1.0)
    on_hand = np.array([mark.body.startswith("hand") for mark in mixture.landmarks])
    assert np.isneginf(mixture.log_weight(True, hands=False)[on_hand]).all()


def test_a_hand_alone_is_believed_less_than_one_on_a_marked_arm(mixture):
    alone, order = share_of(mixture, "knuckle2_r", "asis_r", "asis_l")
    held, _ = share_of(mixture, "knuckle2_r", "wrist_radial_r", "wrist_ulnar_r")
    knuckle = order.index("knuckle2_r")
    assert mixture.context(alone)[0, knuckle] < mixture.context(held)[0, knuckle] / 7


def test_a_place_that_another_marker_has_is_believed_less(mixture):
    share, order = share_of(mixture, "heel_r", "heel_l", "ankle_lateral_r", "knee_lateral_r")
    context = mixture.context(share)
    assert context[2, order.index("heel_r")] < context[0, order.index("heel_r")] / 7


def test_a_place_whose_counterpart_is_marked_is_believed_more(mixture):
    both, order = share_of(mixture, "knee_lateral_r", "knee_lateral_l", "asis_r")
    one, _ = share_of(mixture, "knee_lateral_r", "asis_l", "asis_r")
    knee = order.index("knee_lateral_r")
    assert mixture.context(both)[0, knee] > mixture.context(one)[0, knee] * 2.7
