"""What a file says of its own passes: on the file of 2023, whose names and gravity are not what they say."""

import numpy as np
import pytest

from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.capture.formats.b3d.stored import stored_passes


@pytest.mark.real
def test_the_file_of_2023_is_corrected_causes(real_data):
    """Newton, from the file's own acceleration, forces and mass: the same residual force as is read."""
    path = real_data / "b3d" / "results.b3d"
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    b3d = read_b3d(path)
    for trial in b3d.trials:
        (found,) = stored_passes(b3d.header, [trial])
        assert any("under each other's name" in note for note in found.notes)
        assert any("gravity along −z" in note for note in found.notes)
        assert np.isnan(found.moment_Nm).all()
        frames, step = trial.passes[0], trial.header.trial_timestep
        mass, wrench = b3d.header.mass_kg, np.array(frames.ground_contact_wrench)
        force = wrench.reshape(len(wrench), -1, 6)[..., 3:].sum(axis=1)[1:-1]
        acceleration = np.diff(np.array(frames.com_pos), 2, axis=0) / step**2
        required = mass * (acceleration + np.array([0.0, 9.81, 0.0])) - force
        off = np.abs(found.force_N[1:-1] - np.linalg.norm(required, axis=1))[2:-2]
        assert np.median(off) < 0.1 * mass * 9.81
        assert np.median(found.force_N[3:-3]) < 0.5 * mass * 9.81


def test_nothing_is_said_of_what_is_not_there(small_b3d):
    (first, _) = small_b3d.trials
    (found,) = stored_passes(small_b3d.header, [first])
    assert found.kind == "kinematics"
    np.testing.assert_allclose(found.marker_rms_m, first.header.processing_pass_header[0].marker_rms)
    assert np.isnan(found.force_N).all()
    assert found.notes == ()
