"""What we write for OpenSim, read back; and what OpenSim makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.opensim_reference import referee
from solver.capture.formats.storage import read_storage
from solver.common.errors import CaptureError
from solver.contact.wrenches import FrameMask
from solver.export.opensim import export_opensim
from solver.fitting.fit_result import Fit
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.scaling import with_mass
from tests.made_std import made_std

LOADED = slice(20, 60)  # frames on which the fixture's foot stands


def with_trial(fit: Fit, **changes) -> Fit:
    return replace(fit, trials=(replace(fit.trials[0], **changes),))


def test_all_of_it_is_written_and_named(fit, tmp_path):
    written = export_opensim(fit, tmp_path / "results" / "opensim")
    names = [
        "model.osim",
        "walk_ik.mot",
        "walk_grf.mot",
        "walk_id.sto",
        "walk_external_loads.xml",
        "walk_id_setup.xml",
    ]
    assert [path.name for path in written] == names
    assert sorted(path.name for path in (tmp_path / "results" / "opensim").iterdir()) == sorted(names)


def test_the_model_that_a_subject_came_with_stays_what_it_is(fit, tmp_path):
    own = tmp_path / "own.osim"
    write_skeleton(fit.skeleton, own)
    force = '<Plugin_Force name="of theirs"/><!-- tuned in May -->'
    own.write_text(own.read_text().replace("<JointSet", f"{force}<JointSet"))
    heavier = with_mass(fit.skeleton, 2 * fit.skeleton.mass)
    subject = replace(fit.subject, model=own)
    export_opensim(replace(fit, subject=subject, skeleton=heavier), tmp_path / "out")
    assert force in (tmp_path / "out" / "model.osim").read_text()
    written = load_skeleton(tmp_path / "out" / "model.osim")
    np.testing.assert_allclose([b.mass for b in written.bodies], [2 * b.mass for b in fit.skeleton.bodies])


def test_the_motion_has_locked_and_coupled_coordinates_too(fit, tmp_path):
    export_opensim(fit, tmp_path)
    table = read_storage(tmp_path / "walk_ik.mot")
    assert table.labels == tuple(c.name for c in fit.skeleton.coordinates)
    assert table.in_degrees is False
    knee = fit.trials[0].motion.q[:, fit.skeleton.dofs.index("knee_angle")]
    np.testing.assert_allclose(table.column("knee_angle"), knee)
    np.testing.assert_allclose(table.column("cap_angle"), 0.6 * knee + 0.05)
    np.testing.assert_allclose(table.column("locked_angle"), 0.2)
    np.testing.assert_allclose(table.times, fit.trials[0].motion.times)


def test_the_forces_make_the_recorded_wrench(fit, contacts, tmp_path):
    export_opensim(fit, tmp_path)
    table = read_storage(tmp_path / "walk_grf.mot")
    force, point, torque = (
        np.column_stack([table.column(f"ground_{kind}{axis}") for axis in "xyz"])
        for kind in ("force_foot_r_v", "force_foot_r_p", "torque_foot_r_")
    )
    np.testing.assert_allclose(force, contacts.wrench_ground[:, 0, :3], atol=1e-9)
    np.testing.assert_allclose(np.cross(point, force) + torque, contacts.wrench_ground[:, 0, 3:], atol=1e-9)
    np.testing.assert_allclose(point[LOADED], contacts.cop_ground[LOADED, 0], atol=1e-12)
    np.testing.assert_allclose(torque[LOADED], [[0, 3, 0]] * 40, atol=1e-9)
    np.testing.assert_allclose(point[60:], [contacts.cop_ground[59, 0]] * 30)


def test_a_force_that_does_not_count_is_not_exported(fit, tmp_path):
    counts = np.ones((90, 1), dtype=bool)
    counts[30:40] = False
    export_opensim(with_trial(fit, mask=FrameMask(counts)), tmp_path)
    table = read_storage(tmp_path / "walk_grf.mot")
    np.testing.assert_array_equal(table.values[30:40, [0, 1, 2, 6, 7, 8]], 0.0)
    assert (table.values[[29, 40], 1] > 200).all()


def test_torques_carry_opensims_names(fit, tmp_path):
    export_opensim(fit, tmp_path)
    table = read_storage(tmp_path / "walk_id.sto")
    assert table.labels[:6] == (
        "tilt_moment",
        "list_moment",
        "turn_moment",
        "tx_force",
        "ty_force",
        "tz_force",
    )
    np.testing.assert_allclose(table.values, fit.trials[0].dynamics.joint_torques, rtol=1e-9, atol=1e-9)


def test_their_standard_deviations_stand_beside_them_in_the_same_columns(fit, tmp_path):
    dofs = len(fit.skeleton.dofs)
    written = export_opensim(with_trial(fit, std=made_std(90, dofs)), tmp_path)
    assert tmp_path / "walk_id_std.sto" in written
    table = read_storage(tmp_path / "walk_id_std.sto")
    assert table.labels == read_storage(tmp_path / "walk_id.sto").labels
    np.testing.assert_array_equal(table.values[:, 0], [np.nan] + [0.04] * 89)


def test_a_trial_without_forces_has_its_motion_only(fit, tmp_path):
    written = export_opensim(with_trial(fit, contacts=None, mask=None, dynamics=None), tmp_path)
    assert [path.name for path in written] == ["model.osim", "walk_ik.mot"]


def test_torques_name_frames_that_rest_on_an_predicted_wrench_and_forces_stay_recorded(fit, tmp_path):
    dynamics = fit.trials[0].dynamics
    predicted = np.zeros((len(dynamics.used), len(fit.trials[0].contacts.foot_bodies)), dtype=bool)
    predicted[[3, 4, 5, 9], 0] = True
    marked = with_trial(fit, dynamics=replace(dynamics, wrench_is_predicted=predicted))
    for one, folder in ((fit, tmp_path / "measured"), (marked, tmp_path / "predicted")):
        export_opensim(one, folder)
    titles = [
        (tmp_path / folder / "walk_id.sto").read_text().splitlines()[0]
        for folder in ("measured", "predicted")
    ]
    assert titles == ["walk_id", "walk_id; a foot's wrench predicted from the motion on frames 3-5, 9-9"]
    forces = [(tmp_path / folder / "walk_grf.mot").read_bytes() for folder in ("measured", "predicted")]
    assert forces[0] == forces[1]


def test_names_that_files_cannot_have(fit, tmp_path):
    capture = replace(fit.trials[0].capture, name="../día 2/walk:1")
    written = export_opensim(with_trial(fit, capture=capture), tmp_path)
    assert {path.parent for path in written} == {tmp_path}
    assert written[1].name == "_d_a_2_walk_1_ik.mot"


def test_a_folder_that_cannot_be_made(fit, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CaptureError, match="choose another output folder"):
        export_opensim(fit, tmp_path / "file" / "opensim")


@pytest.mark.opensim
def test_opensim_finds_our_residuals_and_torques(fit, tmp_path):
    """Its inverse dynamics of the exported files, mapped to a wrench by its own Jacobian."""
    pytest.importorskip("opensim")
    folder = tmp_path / "Zoë Ørsted" / "opensim"
    export_opensim(fit, folder)
    verdict = referee(folder, "walk")
    dynamics = fit.trials[0].dynamics
    assert len(verdict.times) == 90
    assert np.abs(dynamics.residual_root).max() > 30
    np.testing.assert_allclose(verdict.residual_root, dynamics.residual_root, atol=1e-4)
    for name in ("hip_adduction", "ankle_angle", "arm_angle"):
        ours = dynamics.joint_torques[:, fit.skeleton.dofs.index(name)]
        np.testing.assert_allclose(verdict.torques[name], ours, atol=1e-4)
    knee = verdict.torques["knee_angle"] + 0.6 * verdict.torques["cap_angle"]  # its cap moves freely
    np.testing.assert_allclose(
        knee, dynamics.joint_torques[:, fit.skeleton.dofs.index("knee_angle")], atol=1e-4
    )
