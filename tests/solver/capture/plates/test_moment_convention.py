"""What moment columns mean: every convention told apart, and every one giving the same wrench."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.capture.formats.storage import Storage, read_storage
from solver.capture.plates.moment_convention import plates_from_storage
from solver.common.errors import CaptureError

ORIGINS = np.array([[1.1, -0.03, 0.4], [1.7, 0.0, -0.2]])
RATE = 500
SAMPLES = 600


@pytest.fixture(params=range(5))
def walk(request):
    """Two steps on two plates: force, centre of pressure, free moment of each."""
    rng = np.random.default_rng(request.param)
    phase = np.linspace(0, 1, 300)
    plates = []
    for k, start in enumerate((50, 250)):
        force = np.zeros((SAMPLES, 3))
        point = np.zeros((SAMPLES, 3))
        free = np.zeros((SAMPLES, 3))
        stance = slice(start, start + 300)
        bell = np.sin(np.pi * phase)
        force[stance] = np.column_stack(
            [-150 * np.sin(2 * np.pi * phase) * bell, 800 * bell, rng.normal(40, 20) * bell]
        )
        offset = rng.uniform(-0.1, 0.1, 2)
        point[stance] = np.column_stack(
            [
                ORIGINS[k, 0] + offset[0] + 0.24 * phase - 0.12,
                np.zeros(300),
                ORIGINS[k, 2] + offset[1] + 0.02 * bell,
            ]
        )
        free[stance, 1] = rng.uniform(-12, 12) * bell * np.cos(rng.uniform(1, 4) * phase)
        plates.append((force, point, free))
    return plates


def storage_of(plates, convention, noise=None):
    columns, labels = [], []
    for k, (force, point, free) in enumerate(plates):
        about = {"free": point, "ground": np.zeros(3), "plate": ORIGINS[k]}[convention]
        moment = np.cross(point - about, force) + free
        if noise is not None:
            moment = moment + noise.normal(0, 0.3, moment.shape) * (force[:, [1]] > 0)
        columns += [force, point, moment]
        labels += [f"ground_force_{k + 1}_{kind}{axis}" for kind in "vpm" for axis in "xyz"]
    values = np.concatenate(columns, axis=1)
    return Storage(
        Path("grf.mot"),
        tuple(labels),
        np.arange(SAMPLES) / RATE,
        values,
        RATE,
        lines=tuple(range(1, SAMPLES + 1)),
    )


MEANING = {"free": "free moment", "ground": "about the ground origin", "plate": "about each plate's origin"}


@pytest.mark.parametrize("convention", MEANING)
def test_each_convention_is_recognised_and_gives_the_true_wrench(walk, convention):
    plates, notes = plates_from_storage(storage_of(walk, convention))
    assert any(MEANING[convention] in note and "mm" in note for note in notes), notes
    for plate, (force, point, free) in zip(plates, walk, strict=True):
        np.testing.assert_array_equal(plate.force_ground, force)
        np.testing.assert_allclose(plate.moment_ground, np.cross(point, force) + free, atol=0.1)
        loaded = force[:, 1] > 20
        np.testing.assert_allclose(plate.cop_ground[loaded], point[loaded])
        assert np.isnan(plate.cop_ground[force[:, 1] < 20]).all()
        assert plate.rate == RATE


@pytest.mark.parametrize("convention", MEANING)
def test_noise_does_not_change_the_decision(walk, convention):
    _, notes = plates_from_storage(storage_of(walk, convention, noise=np.random.default_rng(9)))
    assert any(MEANING[convention] in note for note in notes), notes


@pytest.mark.parametrize("convention", MEANING)
def test_forces_on_the_plate_are_read_alike(walk, convention):
    turned = [(-force, point, -free) for force, point, free in walk]
    plates, notes = plates_from_storage(storage_of(turned, convention))
    assert any(MEANING[convention] in note for note in notes), notes
    for plate, (force, point, free) in zip(plates, turned, strict=True):
        np.testing.assert_allclose(plate.moment_ground, np.cross(point, force) + free, atol=0.1)
        assert np.isfinite(plate.cop_ground[force[:, 1] < -20]).all()


def test_standing_still_at_the_plates_origin_is_no_free_moment():
    rng = np.random.default_rng(0)
    plates = []
    for origin in ORIGINS:
        force = np.column_stack(
            [rng.normal(0, 4, SAMPLES), rng.normal(400, 8, SAMPLES), rng.normal(0, 3, SAMPLES)]
        )
        point = origin * [1, 0, 1] + np.column_stack([*rng.normal(0, 0.012, (2, SAMPLES))])[:, [0, 1, 1]] * [
            1,
            0,
            1,
        ]
        plates.append((force, point, np.zeros((SAMPLES, 3))))
    built, notes = plates_from_storage(storage_of(plates, "plate"))
    assert any(MEANING["plate"] in note for note in notes), notes
    for plate, (force, point, _) in zip(built, plates, strict=True):
        # 3 cm of the origin's height show in the shear force of some 10 N only
        np.testing.assert_allclose(plate.moment_ground, np.cross(point, force), atol=0.5)


def test_spikes_do_not_move_a_plates_origin(walk):
    storage = storage_of(walk, "plate")
    values = storage.values.copy()
    values[150:165, 6:9] += 300
    plates, _ = plates_from_storage(replace(storage, values=values))
    force, point, free = walk[0]
    quiet = np.r_[0:150, 165:SAMPLES]
    np.testing.assert_allclose(
        plates[0].moment_ground[quiet], (np.cross(point, force) + free)[quiet], atol=0.5
    )


@pytest.mark.parametrize("unit_N", [1000.0, 700.0])
def test_forces_too_small_for_anybody_are_asked_about(walk, unit_N):
    storage = storage_of(walk, "free")
    _, notes = plates_from_storage(replace(storage, values=storage.values / unit_N))
    assert any("are the columns in kN, body weights or N/kg" in note for note in notes), notes


def test_the_argument_overrules_and_says_so(walk):
    storage = storage_of(walk, "free")
    plates, notes = plates_from_storage(storage, moment_convention="ground")
    np.testing.assert_array_equal(plates[0].moment_ground, walk[0][2])
    assert any("as stated, although the numbers suggest the free moment" in note for note in notes)
    with pytest.raises(
        CaptureError, match=r"grf\.mot: moment convention 'world': choose free, ground, plate"
    ):
        plates_from_storage(storage, moment_convention="world")


def test_numbers_that_fit_no_convention_are_noted(walk):
    storage = storage_of(walk, "plate")
    values = storage.values.copy()
    values[:, [3, 5, 12, 14]] = np.random.default_rng(2).uniform(-1, 1, (SAMPLES, 4))
    _, notes = plates_from_storage(replace(storage, values=values))
    assert any("contradict each other" in note for note in notes), notes


def test_a_centre_of_pressure_lost_under_load_is_noted(walk):
    storage = storage_of(walk, "free")
    values = storage.values.copy()
    values[150:160, 3:6] = 0
    plates, notes = plates_from_storage(replace(storage, values=values))
    assert any("ground_force_1: no centre of pressure on 10 loaded samples" in note for note in notes), notes
    assert np.isnan(plates[0].cop_ground[150:160]).all()
    force, point, free = walk[0]
    lever = (plates[0].moment_ground - np.cross(point, force) - free)[150:160] / force[150:160, [1]]
    assert np.abs(lever).max() < 0.2


def test_a_missing_centre_of_pressure_is_recomputed(walk):
    storage = storage_of(walk, "ground")
    keep = [k for k, label in enumerate(storage.labels) if "_p" not in label]
    bare = replace(storage, labels=tuple(storage.labels[k] for k in keep), values=storage.values[:, keep])
    plates, notes = plates_from_storage(bare)
    for plate, (force, point, _) in zip(plates, walk, strict=True):
        loaded = force[:, 1] > 20
        np.testing.assert_allclose(plate.cop_ground[loaded], point[loaded], atol=1e-9)
    assert any("no centre of pressure in the file" in note for note in notes)
    with pytest.raises(CaptureError, match="the file does not say where that is"):
        plates_from_storage(bare, moment_convention="plate")


def test_zeros_for_centres_and_moments_are_an_error(walk):
    storage = storage_of(walk, "free")
    values = storage.values * np.array([k % 9 < 3 for k in range(18)])
    with pytest.raises(CaptureError, match="the point where the force acts is unknown"):
        plates_from_storage(replace(storage, values=values))


def test_centres_of_pressure_are_kept_where_no_force_stands_beside_them(walk):
    """The forces of two plates exchanged, none of whose steps overlap: no sample has both."""
    steps = [(force.copy(), point.copy(), free) for force, point, free in walk]
    for force, point, _ in steps:
        point[250:350], force[250:350] = 0.0, 0.0
    exchanged = [(steps[1 - k][0], steps[k][1], np.zeros((SAMPLES, 3))) for k in (0, 1)]
    plates, notes = plates_from_storage(storage_of(exchanged, "free"), moment_convention="free")
    for plate, (force, point, _) in zip(plates, exchanged, strict=True):
        written = point.any(axis=1)
        np.testing.assert_array_equal(plate.force_ground, force)
        np.testing.assert_array_equal(plate.point_ground[written], point[written])
        assert np.isnan(plate.point_ground[~written]).all()
        assert np.isnan(plate.cop_ground).all()
    assert any("no centre of pressure on" in note for note in notes)


def test_columns_of_centres_are_none_where_the_file_has_none(walk):
    storage = storage_of(walk, "ground")
    keep = [k for k, label in enumerate(storage.labels) if "_p" not in label]
    bare = replace(storage, labels=tuple(storage.labels[k] for k in keep), values=storage.values[:, keep])
    assert all(plate.point_ground is None for plate in plates_from_storage(bare)[0])


@pytest.mark.parametrize("convention", MEANING)
def test_millimetres_and_newton_millimetres_are_converted(walk, convention):
    storage = storage_of(walk, convention)
    scale = np.tile([1, 1, 1, 1000, 1000, 1000, 1000, 1000, 1000], 2)
    plates, notes = plates_from_storage(replace(storage, values=storage.values * scale))
    assert any("read as mm" in note for note in notes)
    for plate, (force, point, free) in zip(plates, walk, strict=True):
        np.testing.assert_allclose(plate.moment_ground, np.cross(point, force) + free, atol=0.1)


@pytest.mark.parametrize("far", [0.0, 346.0, np.nan])
def test_unloaded_centres_of_pressure_make_no_moment(walk, far):
    storage = storage_of(walk, "free")
    values = storage.values.copy()
    unloaded = walk[0][0][:, 1] == 0
    values[unloaded, 0:3] = [1.0, 4.0, 1.0]
    values[unloaded, 3:6] = far
    plates, _ = plates_from_storage(replace(storage, values=values))
    centre = np.median(walk[0][1][walk[0][0][:, 1] > 50], axis=0)
    np.testing.assert_allclose(
        plates[0].moment_ground[unloaded], [np.cross(centre, [1.0, 4.0, 1.0])] * unloaded.sum(), atol=1e-6
    )


def test_an_unloaded_moment_beside_a_centre_of_pressure_of_zero_is_about_the_origin(walk):
    """A constant force at the plate's centre, written as a force and a moment where nobody stands."""
    storage = storage_of(walk, "free")
    values = storage.values.copy()
    unloaded = walk[0][0][:, 1] == 0
    bias, about_origin = [-13.0, -8.0, -34.0], [5.0, 17.0, -6.0]
    values[unloaded, 0:3], values[unloaded, 3:6], values[unloaded, 6:9] = bias, 0.0, about_origin
    plates, _ = plates_from_storage(replace(storage, values=values))
    np.testing.assert_allclose(plates[0].moment_ground[unloaded], [about_origin] * unloaded.sum())


def test_missing_rows_are_unknown_not_bridged(walk):
    storage = storage_of(walk, "free")
    keep = np.r_[0:200, 230:SAMPLES]
    cut = replace(storage, times=storage.times[keep], values=storage.values[keep], lines=tuple(keep + 1))
    plates, _ = plates_from_storage(cut)
    assert plates[0].samples == SAMPLES
    assert np.isnan(plates[0].force_ground[200:230]).all()
    np.testing.assert_array_equal(plates[0].force_ground[keep], walk[0][0][keep])


def test_one_row_is_no_recording(walk):
    storage = storage_of(walk, "free")
    with pytest.raises(CaptureError, match="one row of forces is not a recording"):
        plates_from_storage(replace(storage, times=storage.times[:1], values=storage.values[:1], lines=(1,)))


@pytest.mark.real
def test_real_files(real_data):
    about_origins = {"levelground_ccw_fast_01_01_grf.mot"}
    files = [path for path in real_data.rglob("*.mot") if not {"reference", "wild"} & set(path.parts)]
    assert len(files) > 15
    for path in files:
        plates, notes = plates_from_storage(read_storage(path))
        meaning = MEANING["plate"] if path.name in about_origins else MEANING["free"]
        assert any(f"read as the {meaning}" in n or f"read as the moment {meaning}" in n for n in notes), (
            path,
            notes,
        )
        total = np.nansum([plate.force_ground[:, 1] for plate in plates], axis=0)
        assert total.max() > 300
        for plate in plates:
            loaded = plate.force_ground[:, 1] > 50
            assert np.isfinite(plate.cop_ground[loaded]).all()
            assert np.abs(plate.cop_ground[loaded]).max(initial=0) < 10


@pytest.mark.real
def test_moments_about_plate_origins_agree_with_the_centres_of_pressure_of_a_real_file(real_data):
    path = real_data / "overground_camargo2021_AB06" / "levelground_ccw_fast_01_01_grf.mot"
    for plate in plates_from_storage(read_storage(path))[0]:
        loaded = plate.force_ground[:, 1] > 200
        about_centre = plate.moment_ground - np.cross(plate.cop_ground, plate.force_ground)
        lever = np.hypot(about_centre[loaded, 0], about_centre[loaded, 2]) / plate.force_ground[loaded, 1]
        assert np.median(lever) < 0.003
        assert np.median(np.abs(about_centre[loaded, 1])) < 15
