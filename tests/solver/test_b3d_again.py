"""A fit of ours written as B3D and opened as a subject: the same recording, the same frames, the same fit."""

import re

import numpy as np
import pytest

from solver.capture.formats.b3d.b3d_file import write_b3d
from solver.capture.subject.opened_subject import open_subject
from solver.export.b3d.from_fit import fit_to_b3d, with_unfitted_masses
from solver.fitting.pipeline import solve
from solver.skeleton.subject_model import load_subject_model
from tests.conftest import NO_HELD_OUT

pytestmark = [pytest.mark.real, pytest.mark.slow]  # their fixtures take long


@pytest.fixture(scope="module")
def there_and_back(real_data, tmp_path_factory):
    """A walk of the OpenCap recordings, whose forces are at the cameras' rate; its file; the fit of that."""
    folder = real_data / "opencap_subject4"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    fit = solve(open_subject(folder), NO_HELD_OUT, trials=["walking1"])
    path = tmp_path_factory.mktemp("b3d") / "person.b3d"
    b3d = fit_to_b3d(fit)
    write_b3d(b3d, path)
    return fit, b3d, path, solve(open_subject(path), NO_HELD_OUT)


def test_markers_and_plates_come_back(there_and_back):
    fit, b3d, _, again = there_and_back
    (before,), (after,) = fit.trials, again.trials
    assert after.capture.name == before.capture.name == "walking1"
    columns = [after.capture.markers.names.index(name) for name in before.capture.markers.names]
    np.testing.assert_allclose(
        after.capture.markers.positions_ground[:, columns],
        before.capture.markers.positions_ground,
        rtol=0,
        atol=1e-6,
    )
    shape = len(before.motion.times), -1, 3
    force, torque, cop = (
        np.array(getattr(b3d.trials[0].sensors, f"raw_force_plate_{part}")).reshape(shape)
        for part in ("force", "torque", "cop")
    )
    assert len(after.capture.plates) == 2
    for k, plate in enumerate(after.capture.plates):
        np.testing.assert_allclose(plate.force_ground, force[:, k], rtol=0, atol=1e-6)
        moment = torque[:, k] + np.cross(cop[:, k], force[:, k])
        np.testing.assert_allclose(plate.moment_ground, moment, rtol=0, atol=1e-6)


def test_the_same_frames_count_for_the_same_reasons(there_and_back):
    fit, _, _, again = there_and_back
    np.testing.assert_array_equal(fit.trials[0].forces_known, again.trials[0].forces_known)
    said = {reason for _, _, _, reason in again.trials[0].mask.reasons}
    assert {reason for _, _, _, reason in fit.trials[0].mask.reasons} == said


def test_the_fit_of_it_is_the_fit(there_and_back):
    """Angles differ where markers tell little: of a kept model they are placed a second time."""
    fit, _, _, again = there_and_back
    (before,), (after,) = fit.trials, again.trials
    assert after.motion.dofs == before.motion.dofs
    turning = [k for k, name in enumerate(before.motion.dofs) if not re.fullmatch("pelvis_t[xyz]", name)]
    off = np.degrees(after.motion.q - before.motion.q)[:, turning]
    assert np.sqrt((off**2).mean(axis=0)).max() < 0.5
    used = before.dynamics.used
    np.testing.assert_array_equal(used, after.dynamics.used)
    residuals = [np.linalg.norm(one.dynamics.residual_root[used, :3], axis=1) for one in (before, after)]
    rms = [np.sqrt((residual**2).mean()) for residual in residuals]
    assert abs(rms[1] - rms[0]) < 1.0


def test_what_the_file_says_of_itself_is_what_was_found(there_and_back):
    fit, _, _, again = there_and_back
    first, _, last = again.trials[0].capture.stored
    assert (first.kind, last.kind, last.notes) == ("kinematics", "dynamics", ())
    trial = fit.trials[0]
    np.testing.assert_allclose(last.marker_rms_m, trial.marker_errors.rms_per_frame, rtol=1e-5)
    used = trial.dynamics.used
    residual = np.linalg.norm(trial.dynamics.residual_root[:, :3], axis=1)
    np.testing.assert_allclose(last.force_N[used], residual[used], rtol=1e-3, atol=0.01)


def test_its_first_pass_has_not_seen_the_forces(there_and_back):
    """Inertias as before the fit; so the model that is fitted again does not know the answer."""
    fit, b3d, path, _ = there_and_back
    before, fitted, read = with_unfitted_masses(fit), fit.skeleton, load_subject_model(path)
    assert read.mass == pytest.approx(fit.mass_kg)
    masses = [np.array([body.mass for body in skeleton.bodies]) for skeleton in (before, fitted, read)]
    assert np.abs(masses[1] - masses[0]).max() > 0.05
    by_name = {body.name: body for body in before.bodies}
    for body in read.bodies:
        assert body.mass == pytest.approx(by_name[body.name].mass, rel=1e-6)
        np.testing.assert_allclose(body.inertia_body, by_name[body.name].inertia_body, rtol=1e-5, atol=1e-9)
    texts = [one.model_osim_text for one in b3d.header.passes]
    assert texts[0] != texts[1]
