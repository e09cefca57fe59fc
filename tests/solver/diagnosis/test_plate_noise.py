"""The plates' white noise: what was added is found again, and its windows scatter as stated."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.noise.rows import plate_noise, plates_noise
from solver.dynamics.windows import windows_over
from solver.simulate.demo import MARKERS
from solver.simulate.laboratory import measure, plates_under
from solver.skeleton.forward import cross
from tests.solver.diagnosis.causes.conftest import NOISELESS, scene_of_trial

FORCE_N, MOMENT_NM = (3.0, 6.0, 4.0), (1.0, 0.5, 0.8)


@pytest.fixture(scope="module", params=[100.0, 1000.0])
def noisy(short_walk, request):
    """Plates at the markers' rate, and ten times faster."""
    plates = plates_under(short_walk.contacts, (0.0, short_walk.scenario.duration))
    settings = replace(
        NOISELESS, force_rate=request.param, force_noise_N=FORCE_N, moment_noise_Nm=MOMENT_NM, zeroed=False
    )
    capture = measure(short_walk, plates, MARKERS, settings, np.random.default_rng(1))
    return scene_of_trial(short_walk, capture)


def test_the_noise_of_single_samples_is_found_among_steps(noisy):
    """A step has 60 samples at 100 Hz, few for one figure; over plates and axes they are enough."""
    ratios = [
        plate_noise(plate) / (*FORCE_N, *MOMENT_NM) for plate in noisy.plates if plate.loaded.sum() > 30
    ]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.2)


def test_a_plate_of_which_no_stretch_is_whole_tells_nothing(noisy):
    """Samples that a gap's filling bridges are loaded and not recorded."""
    plate = max(noisy.plates, key=lambda p: p.loaded.sum())
    force = plate.plate.force_ground.copy()
    force[::4] = np.nan
    bridged = replace(plate, plate=replace(plate.plate, force_ground=force))
    assert plate_noise(bridged)[:3].tolist() == [0.0, 0.0, 0.0]
    windows = windows_over(np.ones(noisy.frames, dtype=bool), noisy.rate, 0.06, 0.03)
    assert np.isfinite(plates_noise(replace(noisy, plates=(bridged,)), windows)).all()


def test_sound_filtered_plates_have_none(short_scene):
    for plate in short_scene.plates:
        assert plate_noise(plate)[:3].max() < 0.3
        assert plate_noise(plate)[3:].max() < 0.1


def test_windows_scatter_as_stated(noisy):
    """Noise drawn anew goes through the plates' filter to the frames, moments about the centre of mass."""
    windows = windows_over(np.ones(noisy.frames, dtype=bool), noisy.rate, 0.06, 0.03)
    rng = np.random.default_rng(2)
    stated, drawn = plates_noise(noisy, windows), np.zeros((windows.count, 6, 6))
    certain = np.ones(windows.count, dtype=bool)
    draws = 300
    for plate in noisy.plates:
        share = windows.means(plate.loaded.astype(float))
        certain &= (share == 0) | (share == 1)
        for _ in range(draws):
            force = rng.normal(0, FORCE_N, (plate.plate.samples, 3))
            moment = rng.normal(0, MOMENT_NM, force.shape) + cross(plate.centre_ground, force)
            wrench = np.nan_to_num(plate.at_frames(np.concatenate([force, moment], axis=1)))
            wrench[:, 3:] -= cross(noisy.com_ground, wrench[:, :3])
            means = windows.means(wrench) * share[:, None]
            drawn += means[:, :, None] * means[:, None, :] / draws
    inner = certain & (stated[:, 1, 1] > 0)
    inner[:5] = inner[-5:] = False
    assert inner.sum() > 20
    ratio = np.linalg.eigvals(np.linalg.solve(stated[inner].mean(axis=0), drawn[inner].mean(axis=0))).real
    assert ratio.min() > 0.5  # the filter takes some of it, and it is not counted on
    assert ratio.max() < 1.2
