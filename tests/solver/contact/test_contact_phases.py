import numpy as np

from solver.contact.contact_phases import contact_phases
from solver.contact.settings import ContactSettings

RATE = 100.0


def phases_of(walk, *plates):
    found = walk.assigned(*plates)
    return contact_phases(found, *walk.poses(), skeleton=walk.skeleton, rate=RATE, settings=ContactSettings())


def test_steps_on_and_off_the_plates(walk):
    """Right stands on plates at 5-65 and 95-155, beside them from 185; left at 50-110, 140-200, from 230."""
    plates = [walk.plate(s, [(walk.loads[:, i], walk.under[:, i])]) for i, s in enumerate("rl")]
    phases = phases_of(walk, *plates)
    for foot, starts in ((0, (5, 95)), (1, (50, 140))):
        measured = [p for p in phases if p.foot == foot and p.loaded > 0.8]
        assert [abs(p.start - start) <= 4 for p, start in zip(measured, starts, strict=True)] == [True, True]
        assert [abs(p.end - start - 61) <= 4 for p, start in zip(measured, starts, strict=True)] == [
            True,
            True,
        ]
    off = [p for p in phases if p.loaded == 0]
    for foot, start in ((0, 185), (1, 230)):
        assert any(p.foot == foot and abs(p.start - start) <= 4 for p in off)


def test_a_belt_moves_under_the_feet(treadmill_walk):
    walk = treadmill_walk
    plates = [walk.plate(s, [(walk.loads[:, i], walk.under[:, i])]) for i, s in enumerate("rl")]
    stands = [(p.foot, p.start, p.end) for p in phases_of(walk, *plates) if p.loaded == 0]
    assert any(foot == 0 and abs(start - 185) <= 4 for foot, start, _ in stands)


def test_standing_is_one_phase(standing):
    point = standing.ankles[:, 0] * [1, 0, 1]
    phases = phases_of(standing, standing.plate("1", [(np.full(100, 350.0), point)]))
    assert [(p.foot, p.start, p.end, p.loaded) for p in phases] == [(0, 0, 100, 1.0), (1, 0, 100, 0.0)]
