import numpy as np
import pytest

from solver.dynamics.cross_validation.held_out_layouts import every_third, frames_of, random_shares, steps_of

STEPS = [(10 * k, 10 * k + 6) for k in range(7)]


def test_contacts_cut_by_the_ends_are_steps_and_blips_are_not():
    contact = np.zeros(100, dtype=bool)
    contact[:20] = contact[40:44] = contact[60:65] = contact[90:] = True
    assert steps_of(contact, 100.0) == [(0, 20), (60, 65), (90, 100)]


def test_every_third_step_begins_in_three_ways_that_share_the_steps_out():
    choices = every_third(STEPS, 10)
    assert [c[0] for c in choices] == STEPS[:3]
    assert sorted(step for c in choices for step in c) == STEPS
    assert len(every_third(STEPS, 2)) == 2


@pytest.mark.parametrize(("fraction", "hidden"), [(0.01, 1), (0.3, 2), (0.6, 4)])
def test_random_choices_hide_that_share_and_never_repeat(fraction, hidden):
    choices = random_shares(STEPS, fraction, 6, np.random.default_rng(0))
    assert len(choices) == len({tuple(c) for c in choices}) == 6
    assert {len(c) for c in choices} == {hidden}
    assert choices == random_shares(STEPS, fraction, 6, np.random.default_rng(0))


def test_where_there_are_fewer_choices_all_of_them_are_made():
    assert sorted(random_shares(STEPS[:3], 0.3, 10, np.random.default_rng(0))) == [[s] for s in STEPS[:3]]


def test_frames_of_steps():
    assert np.flatnonzero(frames_of([(2, 4), (7, 8)], 10)).tolist() == [2, 3, 7]
    assert np.flatnonzero(frames_of([(1, 2), (7, 8)], 10, border=2)).tolist() == [0, 1, 2, 3, 5, 6, 7, 8, 9]
