from itertools import product

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from solver.contact.detection_states import (
    ELSEWHERE_ODDS,
    LOSS_COST,
    PARTLY_ODDS,
    TOUCH_COST,
    UNLOADED_COST,
    Foot,
    FrameEvidence,
    likeliest_contact_states,
    missing_odds,
)

RATE = 25.0  # [Hz] one frame is one independent moment


def frame_evidence(missing, ground, loaded, partly=None, place=0.0):
    missing, ground, loaded = np.array(missing, float), np.array(ground, float), np.array(loaded, bool)
    feet = ground.shape[1]
    partly = np.full(ground.shape, -2.0) if partly is None else np.array(partly, float)
    sets = [
        s for n in range(1, feet + 1) for s in product(range(feet), repeat=n) if list(s) == sorted(set(s))
    ]
    return FrameEvidence(
        missing, partly, ground, {s: np.full(len(missing), place) for s in sets}, loaded, RATE
    )


@pytest.mark.parametrize(
    ("missing", "error", "least", "most"),
    [(30.0, 20.0, 0.0, 1400.0), (-60.0, 20.0, 0.0, 1400.0), (300.0, 90.0, 140.0, 2100.0)],
)
def test_odds_are_those_of_the_two_densities(missing, error, least, most):
    nearest = min(max(missing, least), most)
    density, _ = quad(lambda u: norm.pdf(missing, u, error), least, most, limit=500, points=[nearest])
    wanted = np.log(density / (most - least) / norm.pdf(missing, 0.0, error))
    found = missing_odds(*(np.array([v]) for v in (missing, error, least, most)))
    assert found[0] == pytest.approx(wanted, abs=1e-6)


def test_no_overflow_far_from_everything():
    z = np.array([-1e5, -50.0, 50.0, 1e5])
    found = missing_odds(z, np.ones(4), np.zeros(4), np.full(4, 100.0))
    assert np.isfinite(found).all()


def test_the_path_is_the_cheapest_of_all():
    """Against every sequence of states of one foot and of what else may carry the body."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        given = frame_evidence(
            rng.normal(0, 3, 5), rng.normal(0, 2, (5, 1)), [[0], [0], [1], [1], [0]], rng.normal(0, 3, (5, 1))
        )
        contact_states = likeliest_contact_states(given)
        states = list(product(Foot, (0, 1)))
        best = min(product(states, repeat=5), key=lambda path: total(path, given))
        assert total(
            list(zip(contact_states.feet[:, 0], contact_states.elsewhere, strict=True)), given
        ) == pytest.approx(total(best, given))


def total(path, given):
    """The cost of one foot's path, stated once more."""
    cost = 0.0
    for t, (foot, elsewhere) in enumerate(path):
        standing, on = 0.5 * given.ground[t, 0], given.loaded[t, 0]
        if elsewhere:
            cost += ELSEWHERE_ODDS - given.missing[t] - abs(standing)
        else:
            cost += standing if foot == Foot.UP else -standing
        if foot == Foot.LOST:
            cost += PARTLY_ODDS * on
            if not elsewhere:
                cost -= given.partly[t, 0] if on else given.missing[t]
        elif on != (foot == Foot.MEASURED):
            cost += UNLOADED_COST
        if t:
            before, beside = path[t - 1]
            cost += LOSS_COST * (bool(beside) != bool(elsewhere))
            if foot != before and Foot.LOST in (foot, before):
                cost += TOUCH_COST
                same_load = given.loaded[t - 1, 0] == on
                if Foot.MEASURED in (foot, before) and same_load:
                    cost += LOSS_COST
    return cost


def test_a_standing_foot_without_force_is_lost_and_a_swinging_one_is_not():
    missing = [-3.0] * 5 + [4.0] * 10 + [-3.0] * 5
    ground = [[-2.0, -2.0]] * 5 + [[2.0, -2.0]] * 10 + [[-2.0, -2.0]] * 5
    contact_states = likeliest_contact_states(frame_evidence(missing, ground, [[0, 0]] * 20))
    np.testing.assert_array_equal(contact_states.lost[:, 0], [0] * 5 + [1] * 10 + [0] * 5)
    assert not contact_states.lost[:, 1].any()
    assert not contact_states.elsewhere.any()


def test_a_foot_at_rest_without_missing_force_is_up():
    """Standing on the other leg, this foot held still in the air."""
    contact_states = likeliest_contact_states(frame_evidence([-3.5] * 20, [[2.5, 2.5]] * 20, [[0, 1]] * 20))
    assert (contact_states.feet[:, 0] == Foot.UP).all()
    assert (contact_states.feet[:, 1] == Foot.MEASURED).all()


def test_what_presses_under_no_foot_is_elsewhere():
    given = frame_evidence([4.0] * 20, [[2.5, 2.5]] * 20, [[0, 0]] * 20, place=4.0)
    contact_states = likeliest_contact_states(given)
    assert contact_states.elsewhere.all()
    assert not contact_states.lost.any()
