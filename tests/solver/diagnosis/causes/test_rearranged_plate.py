"""A plate that the files turn, mirror or scale is corrected exactly; each cause is there by itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from solver.diagnosis.causes.gross_cause import with_samples
from solver.diagnosis.causes.rearranged_plate import FACTORS, MIRRORS, PlateMirror, PlateTurn, PlateUnits
from tests.solver.diagnosis.causes.conftest import RATE


def as_filed(scene, wrench_of):
    """The trial with its first plate's samples changed one by one, about the plate's middle."""
    plate = next(p for p in scene.plates if p.loaded.any())
    samples = plate.loads.wrench_ground.copy()
    for k, (force, moment) in enumerate(zip(samples[:, :3].copy(), samples[:, 3:].copy(), strict=True)):
        about = moment - np.cross(plate.centre_ground, force)
        filed, about_middle = wrench_of(force, about)
        samples[k] = [*filed, *(about_middle + np.cross(plate.centre_ground, filed))]
    changed = with_samples(plate, samples, plate.loads.carrying)
    return plate.target, replace(
        scene, plates=tuple(changed if p.target == plate.target else p for p in scene.plates)
    )


def turned_by(degrees):
    """By Rodrigues about the vertical."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))

    def turn(v):
        up = np.array([0.0, 1.0, 0.0])
        return v * c + np.cross(up, v) * s + up * (up @ v) * (1 - c)

    return lambda force, moment: (turn(force), turn(moment))


@pytest.mark.parametrize("degrees", [90, 180, -90])
def test_a_turned_plate_is_turned_back(scene, degrees):
    target, wrong = as_filed(scene, turned_by(degrees))
    signature = PlateTurn(target, degrees).signature(wrong, ())
    np.testing.assert_allclose(
        wrong.measured_ground + signature.fixed, scene.measured_ground, atol=1e-6 * scene.weight_N
    )
    assert signature.columns.shape[2] == 2
    assert PlateTurn("plate_99", degrees).signature(wrong, ()) is None


def test_a_mirrored_plate_has_pressures_on_the_other_side(scene):
    """Forces at mirrored places: a moment about the middle is made anew from place and force."""
    target, wrong = as_filed(scene, lambda f, m: (f * (-1, 1, 1), m * (1, -1, -1)))
    signature = PlateMirror(target, 0).signature(wrong, ())
    np.testing.assert_allclose(
        wrong.measured_ground + signature.fixed, scene.measured_ground, atol=1e-6 * scene.weight_N
    )
    place, force = np.array([0.1, 0.0, 0.2]), np.array([5.0, 700.0, 30.0])
    M = MIRRORS[45]
    np.testing.assert_allclose(
        np.linalg.det(M) * M @ np.cross(place, force), np.cross(M @ place, M @ force), atol=1e-9
    )


def test_units_scale_force_and_moment(scene):
    target, wrong = as_filed(scene, lambda f, m: (f / 4.448222, m / 4.448222))
    signature = PlateUnits(target, 1 / 4.448222).signature(wrong, ())
    np.testing.assert_allclose(
        wrong.measured_ground + signature.fixed, scene.measured_ground, atol=1e-5 * scene.weight_N
    )
    assert signature.columns.shape[2] == 0
    assert PlateUnits(target, 0.5).plate_factors() == {target: 0.5}
    assert PlateTurn(target, 90).plate_factors() == {}


def test_larger_units_pay_for_the_smaller_rests_that_they_leave():
    """Density of recorded = 2 (required + error), against that of what would be true, by SciPy."""
    rng = np.random.default_rng(0)
    required = rng.normal(700, 100, 50)
    recorded = required + rng.normal(0, 60, 50)
    candidate = PlateUnits("plate_1", 2.0, rows=50)
    of_recorded = norm.logpdf(recorded, 2 * required, 2 * 60).sum()
    of_true = norm.logpdf(recorded / 2, required, 60).sum()
    assert of_true + candidate.seen_elsewhere == pytest.approx(of_recorded)
    assert PlateUnits("plate_1", 0.5, rows=50).seen_elsewhere == 0


def test_a_middle_that_lies_elsewhere_is_a_shift(scene):
    """Turned about a point 8 cm off: the columns make up for it."""
    target, wrong = as_filed(scene, turned_by(180))
    plate = next(p for p in wrong.plates if p.target == target)
    moved = plate.loads.wrench_ground.copy()
    moved[:, 3:] += np.cross((0.16, 0.0, 0.0), moved[:, :3])
    wrong = replace(
        wrong,
        plates=tuple(
            with_samples(plate, moved, plate.loads.carrying) if p.target == target else p
            for p in wrong.plates
        ),
    )
    signature = PlateTurn(target, 180).signature(wrong, ())
    lack = (scene.measured_ground - wrong.measured_ground - signature.fixed).reshape(-1)
    columns = signature.columns.reshape(-1, 2)
    x = np.linalg.lstsq(columns, lack, rcond=None)[0]
    assert np.abs(columns @ x - lack).max() < 1e-3 * np.abs(lack).max()
    assert np.abs(x) == pytest.approx([0.16, 0.0], abs=1e-3)


def test_each_plate_has_each_of_them(scene):
    loaded = sum(p.loaded.any() for p in scene.plates)
    assert len(PlateTurn.candidates([scene])) == 3 * loaded
    assert len(PlateMirror.candidates([scene])) == len(MIRRORS) * loaded
    assert len(PlateUnits.candidates([scene])) == len(FACTORS) * loaded
    assert {
        c.key[0]
        for c in (
            *PlateTurn.candidates([scene]),
            *PlateMirror.candidates([scene]),
            *PlateUnits.candidates([scene]),
        )
    } == {"plate_turn", "plate_mirror", "plate_units"}
    assert scene.rate == RATE
