import numpy as np
import pytest

from solver.simulate.laboratory import (
    MeasurementSettings,
    Plate,
    measure,
    plates_under,
    stances_within,
    standing_plates,
)
from solver.skeleton.forward import marker_positions

PERFECT = MeasurementSettings(
    marker_noise_m=0.0,
    gaps_per_marker_minute=0.0,
    force_noise_N=(0.0, 0.0, 0.0),
    moment_noise_Nm=(0.0, 0.0, 0.0),
    threshold_N=1e-6,
    skin=False,
)
NAMES = ("RASI", "LASI", "SACR", "RTH1", "LTOE", "C7")


@pytest.fixture(scope="module")
def plates(walk):
    return plates_under(walk.contacts, (0.0, 2.4), missed=(2,), yaw=np.radians(25.0))


@pytest.fixture(scope="module")
def perfect(walk, plates):
    return measure(walk, plates, NAMES, PERFECT, np.random.default_rng(0))


@pytest.fixture(scope="module")
def real(walk, plates):
    return measure(
        walk, plates, NAMES, MeasurementSettings(gaps_per_marker_minute=30), np.random.default_rng(0)
    )


def test_without_noise_the_plates_hold_the_feet_they_bear(walk, perfect):
    times = perfect.plates[0].times
    feet = walk.reactions(times).wrench_ground.sum(axis=1)
    sum_of_plates = sum(np.concatenate([p.force_ground, p.moment_ground], axis=1) for p in perfect.plates)
    missed = stances_within(walk.contacts, (0.0, 2.4))[2]
    elsewhere = ~missed.covers(times)
    np.testing.assert_allclose(sum_of_plates[elsewhere], feet[elsewhere], atol=1e-3)


def test_a_step_without_a_plate_leaves_no_trace(walk, perfect):
    times = perfect.plates[0].times
    missed = stances_within(walk.contacts, (0.0, 2.4))[2]
    alone = missed.covers(times) & (walk.contacts.shares(times)[:, missed.foot] == 1)
    assert alone.sum() > 100
    for plate in perfect.plates:
        assert (plate.force_ground[alone] == 0).all()


def test_without_noise_the_markers_are_the_models_own(walk, perfect):
    motion = walk.frames(100.0)
    model = walk.body.skeleton
    columns = [model.marker_names.index(name) for name in NAMES]
    np.testing.assert_allclose(
        perfect.markers.positions_ground, marker_positions(model, motion.q)[:, columns], atol=1e-12
    )


def test_noise_and_gaps_are_as_set(walk, perfect, real):
    missing = np.isnan(real.markers.positions_ground[..., 0])
    assert 0.005 < missing.mean() < 0.3
    assert (np.isnan(real.markers.positions_ground).all(axis=2) == missing).all()
    off = np.nanstd(np.diff(real.markers.positions_ground - perfect.markers.positions_ground, axis=0))
    assert off == pytest.approx(0.0002 * np.sqrt(2), rel=0.2)
    loaded = real.plates[1].force_ground[:, 1] > 100
    noise = (real.plates[1].force_ground - perfect.plates[1].force_ground)[loaded]
    np.testing.assert_allclose(noise.std(axis=0), [0.8, 1.5, 0.8], rtol=0.2)


def test_an_unloaded_plate_reads_zero_and_has_no_centre_of_pressure(real):
    for plate in real.plates:
        unloaded = plate.force_ground[:, 1] == 0
        assert np.isnan(plate.cop_ground[unloaded]).all()
        assert np.isfinite(plate.cop_ground[~unloaded]).all()


def test_corners_enclose_what_the_plate_holds():
    plate = Plate((1.0, 2.0), 0.3, 0.2, yaw=0.5)
    corners = plate.corners_ground
    centre = corners.mean(axis=0)
    np.testing.assert_allclose(centre, [1, 0, 2], atol=1e-12)
    assert plate.holds(centre + 0.99 * (corners - centre)).all()
    assert not plate.holds(centre + 1.01 * (corners - centre)).any()
    assert not plate.holds(np.full(3, np.nan))
    assert np.linalg.norm(corners[1] - corners[0]) == pytest.approx(0.4)
    assert np.linalg.norm(corners[2] - corners[1]) == pytest.approx(0.6)


def test_a_standing_person_has_a_plate_for_each_foot(squat):
    plates = standing_plates(squat.contacts)
    reactions, sole = squat.reactions(np.linspace(0, 3.2, 50)), squat.body.sole
    for foot in (0, 1):
        assert plates[foot].holds(reactions.cop_ground[:, foot]).all()
        assert not plates[1 - foot].holds(reactions.cop_ground[:, foot]).any()
        outline = squat.contacts.stances[foot].to_ground(
            np.array([[x, 0.0, z] for x in (sole.heel, sole.toe_tip) for z in (-0.04, 0.04)])
        )
        assert plates[foot].holds(outline).all()
