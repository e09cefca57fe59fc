"""When a plate is suspected, and when not."""

import numpy as np
import pytest
from scipy.stats import multivariate_t

from solver.diagnosis.direct_checks.run_checks import LEVELS, suspect_plates
from solver.diagnosis.direct_checks.statement import FAULTY_DOF, SOUND_DOF, About, Statement, nats_of


@pytest.mark.parametrize("axes", [1, 2])
@pytest.mark.parametrize(
    ("figure", "std", "sound", "usual"), [(0.05, 0.01, 0.03, 0.15), (0.3, 0.0, 0.02, 0.1)]
)
def test_nats_are_of_two_statistics_densities_in_a_line_or_a_plane(axes, figure, std, sound, usual):
    at = np.eye(axes)[0] * figure
    faulty, whole = (
        multivariate_t(np.zeros(axes), np.eye(axes) * (std**2 + scale**2), df=dof).logpdf(at)
        for scale, dof in ((usual, FAULTY_DOF), (sound, SOUND_DOF))
    )
    assert nats_of(figure, std, sound, usual, axes) == pytest.approx(faulty - whole, rel=1e-9)


def said(target, direct_check="path of the pressure", **nats):
    return Statement(direct_check, "…", {About(k): v for k, v in nats.items()}, {}, target=target)


@pytest.mark.parametrize(
    ("statements", "suspect"),
    [
        (
            [said("plate_1", plate_turned_or_mirrored=20.0), said("plate_2", plate_turned_or_mirrored=-3.0)],
            {"plate_1"},
        ),
        ([said("plate_1", plate_place=7.0), said("plate_2", plate_sign=9.0)], {"plate_1", "plate_2"}),
        ([said("plate_1", plate_place=5.5)], set()),
        ([said("plate_1", plate_zero=50.0)], set()),  # of a pressure, which much else moves
        ([said("plate_1", LEVELS, plate_zero=50.0, plate_sign=-50.0)], {"plate_1"}),
        ([said("plate_1", LEVELS, plate_zero=50.0, plate_sign=-2.0)], set()),
        ([said("plate_1", LEVELS, plate_zero=-1.0, plate_sign=-50.0)], set()),  # taken off on reading
        ([said("plate_1+plate_2", plate_sign=40.0)], set()),  # one of the two, nobody knows which
        ([said("plate_1", plate_turned_or_mirrored=20.0), said(None, clock=12.0)], set()),
        ([said("plate_1", plate_place=7.0), said("plate_2", plate_place=6.5)], set()),  # soles or cameras
        ([said("plate_1", plate_place=6.1), said("plate_2", plate_place=5.9)], set()),
        (
            [said("plate_1", plate_place=6.5), said("plate_2", plate_place=0.5)],
            set(),
        ),  # nor is the other in place
        ([said("plate_1", plate_place=7.0), said("plate_2", plate_place=-2.0)], {"plate_1"}),
        ([], set()),
    ],
)
def test_a_plate_is_suspect_by_what_is_gross_and_its_own(statements, suspect):
    assert suspect_plates(statements) == suspect
