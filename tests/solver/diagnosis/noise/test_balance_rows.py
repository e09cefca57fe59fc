"""Rows of one trial, and the noise of its plates."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from solver.common.errors import FitError
from solver.diagnosis.causes.catalogue import catalogue
from solver.diagnosis.diagnose_subject import balance_of
from solver.diagnosis.noise.balance_rows import (
    END_S,
    WINDOW_S,
    TrialRows,
    plate_noise,
    plates_noise,
    trial_rows,
)
from solver.diagnosis.noise.model_errors import unseen_posture
from solver.diagnosis.unmodelled.open_world import outside_the_list
from solver.diagnosis.unmodelled.remainder import unknown_forces
from solver.dynamics.force_prediction.marker_posterior import marker_posterior
from solver.dynamics.root_wrench import centre_of_mass
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.weighted_means import windows_over
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.simulate.demo_subject import MARKERS
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.laboratory import measure, plates_under
from solver.skeleton.forward import ForwardKinematics, cross
from tests.solver.diagnosis.causes.conftest import NOISELESS, scene_of_trial

SETTINGS = DiagnosisSettings()
HOP_S = 0.09
FRAMES = 80


@pytest.fixture(scope="module")
def posterior(short_scene):
    """Of markers whose errors are what the noise says: of each one, and of each segment's together."""
    seen, bodies = short_scene.markers.model_ground[:FRAMES], short_scene.markers.body
    noise = replace(SETTINGS.markers, own_share=0.0, shared_share=0.0, least_m=0.002)
    rng = np.random.default_rng(0)
    t = np.arange(FRAMES) / short_scene.rate
    in_time = np.linalg.cholesky(np.exp(-np.abs(t[:, None] - t) / noise.time_s))
    together = np.linalg.cholesky(np.eye(len(bodies)) + (bodies[:, None] == bodies))
    errors = np.einsum("ts,mn,snc->tmc", in_time, together, rng.normal(0, noise.least_m, seen.shape))
    start = replace(short_scene.motion, q=short_scene.motion.q[:FRAMES])
    return marker_posterior(short_scene.skeleton, seen + errors, start, noise, TrajectorySettings())


@pytest.fixture(scope="module")
def scene(short_scene, posterior):
    """The first 0.8 s, its demand that of the posterior's motion."""
    first = slice(0, FRAMES)
    poses = ForwardKinematics(short_scene.skeleton).poses(posterior.motion.q)
    demand = GroundDemand(posterior.model)
    counts = np.ones(FRAMES, dtype=bool)
    counts[30:33] = False
    plates = tuple(
        replace(p, wrench_ground=p.wrench_ground[first], loaded=p.loaded[first]) for p in short_scene.plates
    )
    return replace(
        short_scene,
        motion=posterior.motion,
        velocity=posterior.velocity,
        acceleration=posterior.acceleration,
        R_ground_body=poses.R_ground_body,
        p_ground_body=poses.p_ground_body,
        material=short_scene.material[first],
        com_ground=centre_of_mass(short_scene.skeleton, poses),
        required_ground=demand.wrench(posterior.motion.q, posterior.velocity, posterior.acceleration),
        plates=plates,
        counts=counts,
    )


@pytest.fixture(scope="module")
def rows(scene, posterior):
    return trial_rows(scene, posterior, SETTINGS, HOP_S)


def test_rows_and_the_covariances_rows_are_of_one_residual(scene, posterior, rows):
    """Required less measured about the centre of mass, force before moment, window by window."""
    by_posterior = rows.windows.means(posterior.momentum(scene.measured_ground).residual).ravel()
    np.testing.assert_allclose(rows.residual, by_posterior, atol=1e-6)


def test_plates_noise_is_added_to_the_markers_and_the_posture_that_none_shows(scene, posterior, rows):
    markers = posterior.covariance(posterior.momentum(scene.measured_ground), rows.windows)
    markers += unseen_posture(scene, rows.windows)
    noise = np.diag(rows.covariance - markers).reshape(-1, 6)
    np.testing.assert_allclose(noise[:, :3], SETTINGS.force_noise_N**2, rtol=1e-6)
    np.testing.assert_allclose(noise[:, 3:], SETTINGS.moment_noise_Nm**2, rtol=1e-6)
    assert np.linalg.eigvalsh(rows.covariance)[0] > 0


def test_white_noise_of_raw_plates_comes_on_top(scene, posterior, rows):
    rng = np.random.default_rng(3)
    raw = tuple(
        replace(
            p,
            plate=replace(
                p.plate, force_ground=p.plate.force_ground + rng.normal(0, 30, p.plate.force_ground.shape)
            ),
        )
        for p in scene.plates
    )
    noisy = replace(scene, plates=raw)
    blocks = (trial_rows(noisy, posterior, SETTINGS, HOP_S).covariance - rows.covariance).reshape(
        rows.windows.count, 6, rows.windows.count, 6
    )
    own = np.arange(rows.windows.count)
    np.testing.assert_allclose(blocks[own, :, own], plates_noise(noisy, rows.windows), atol=1e-6)
    assert np.sqrt(blocks[own, 0, own, 0]).max() > 2
    blocks[own, :, own] = 0
    assert np.abs(blocks).max() < 1e-6


def test_what_markers_errors_do_to_the_residual_lies_within_its_covariance(short_scene, rows):
    """A walk is no draw from the prior: mean squares near one, not above it by more than chance."""
    exact = short_scene.required_ground[:FRAMES] - short_scene.measured_ground[:FRAMES]
    exact[:, 3:] -= np.cross(short_scene.com_ground[:FRAMES], exact[:, :3])
    wrong = rows.residual - rows.windows.means(exact).ravel()
    share = wrong @ np.linalg.solve(rows.covariance, wrong) / len(wrong)
    assert 0.2 < share < 1 + 3 * np.sqrt(2 / len(wrong))


def test_ends_and_frames_that_do_not_count_are_in_no_window(rows):
    ends = round(END_S * 100.0)
    touched = rows.windows.start[:, None] + np.arange(rows.windows.length)
    assert touched.min() >= ends
    assert touched.max() < FRAMES - ends
    assert not np.isin([30, 31, 32], touched).any()
    assert rows.model_error.shape == rows.covariance.shape
    assert len(rows.nuisance) == len(rows.residual)


def test_frames_that_are_too_few_or_too_scattered_are_refused_with_their_number(scene, posterior):
    here_and_there = np.zeros(FRAMES, dtype=bool)
    here_and_there[[10, 40]] = True
    fit = SimpleNamespace(subject=SimpleNamespace(folder=Path("lab/S4")))
    with pytest.raises(FitError, match=r"^lab/S4: 2 of 80 frames have markers and the forces of all feet"):
        balance_of(fit, [(replace(scene, counts=here_and_there), posterior)], SETTINGS)


@pytest.mark.parametrize("hop_s", [0.03, 0.2])
def test_a_signature_in_pieces_gives_the_rows_of_the_whole(short_scene, hop_s):
    windows = windows_over(short_scene.counts, short_scene.rate, WINDOW_S, hop_s)
    nothing = np.zeros((0, 0))
    rows = TrialRows(short_scene, windows, nothing, nothing, nothing, nothing, np.zeros(0))
    found = [(c, e) for c in catalogue([short_scene]) for e in c.starts([short_scene])[:1]]
    assert {"belt_acceleration", "clock_offset", "plate_gain", "segment_mass"} <= {c.id for c, _ in found}
    found += [(c, c.starts([short_scene])[0]) for c in outside_the_list([short_scene])]
    found += [(c, c.starts([short_scene])[0]) for c in unknown_forces([short_scene])[-2:]]
    for candidate, eta in found:
        whole, by_pieces = candidate.signature(short_scene, eta), rows.rows_of(candidate, eta)
        if whole is None:
            assert by_pieces is None
            continue
        np.testing.assert_allclose(by_pieces.columns, about_com(rows, whole.columns), atol=1e-9)
        np.testing.assert_array_equal(by_pieces.prior_std, whole.prior_std)
        if whole.fixed is not None:
            fixed = about_com(rows, whole.fixed[:, :, None])[:, 0]
            np.testing.assert_allclose(by_pieces.fixed, fixed, atol=1e-9)


def about_com(rows, columns):
    """Window means of wrenches, each moment about its frame's centre of mass, of all frames."""
    force, moment = columns[:, :3].transpose(0, 2, 1), columns[:, 3:].transpose(0, 2, 1)
    moment = moment - np.cross(rows.scene.com_ground[:, None], force)
    means = rows.windows.means(np.concatenate([force, moment], axis=2).transpose(0, 2, 1))
    return means.reshape(6 * rows.windows.count, columns.shape[2])


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
