"""Setups for OpenSim's tools on a model with muscles, and what the tools make of a recorded walk."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import parse

import numpy as np
import pytest

from solver.capture.formats.storage import read_storage
from solver.export.opensim import export_opensim
from solver.fitting.fit_result import Fit
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton

ACTUATOR = '<CoordinateActuator name="a"><coordinate>arm_angle</coordinate></CoordinateActuator>'


@pytest.fixture
def muscled(fit, tmp_path) -> Fit:
    """A subject whose own model has a muscle over the hip, and a motor of its own at the arm."""
    own, names = tmp_path / "own.osim", fit.skeleton.body_names
    points = "".join(
        f'<PathPoint name="p{name}"><socket_parent_frame>/bodyset/{name}</socket_parent_frame>'
        "<location>0.1 0 0</location></PathPoint>"
        for name in (names[0], names[1])
    )
    muscle = (
        f'<Thelen2003Muscle name="m"><GeometryPath name="path"><PathPointSet><objects>{points}</objects>'
        "</PathPointSet></GeometryPath><optimal_fiber_length>0.1</optimal_fiber_length></Thelen2003Muscle>"
    )
    write_skeleton(fit.skeleton, own)
    forces = f'<ForceSet name="forceset"><objects>{muscle}{ACTUATOR}</objects></ForceSet>'
    own.write_text(own.read_text().replace("<ConstraintSet", f"{forces}<ConstraintSet"))
    return replace(fit, subject=replace(fit.subject, model=own))


def strengths(path: Path) -> dict[str, float]:
    return {
        str(node.findtext("coordinate")): float(node.findtext("optimal_force"))
        for node in parse(path).iter("CoordinateActuator")
        if node.find("optimal_force") is not None
    }


def test_reserves_are_weak_where_a_muscle_crosses_and_strong_where_nothing_else_acts(muscled, tmp_path):
    export_opensim(muscled, tmp_path / "out")
    write_skeleton(muscled.skeleton, muscled.subject.model)  # without muscles there are none
    assert not any("_so_" in path.name for path in export_opensim(muscled, tmp_path / "bare"))
    found = strengths(tmp_path / "out" / "reserve_actuators.xml")
    assert found.keys() == set(muscled.skeleton.dofs) - {"arm_angle"}
    crossed = {a.coordinate for a in muscled.skeleton.joints[1].axes}
    assert found == {name: 1.0 if name in crossed else 100.0 for name in found}


def test_mocos_model_has_no_locks_and_carries_the_actuators(muscled, tmp_path):
    export_opensim(muscled, tmp_path / "out")
    moco, reserves = tmp_path / "out" / "model_moco.osim", tmp_path / "out" / "reserve_actuators.xml"
    assert strengths(moco) == {**strengths(reserves), "locked_angle": 1000.0}
    assert set(load_skeleton(moco).dofs) == {*muscled.skeleton.dofs, "locked_angle"}
    assert load_skeleton(tmp_path / "out" / "model.osim").dofs == muscled.skeleton.dofs


def test_setups_name_files_that_are_there_and_the_longest_stretch_that_counts(muscled, tmp_path):
    used = np.zeros(90, dtype=bool)
    used[5:9], used[30:51] = True, True
    trial = muscled.trials[0]
    counted = replace(muscled, trials=(replace(trial, dynamics=replace(trial.dynamics, used=used)),))
    files = {path.name for path in export_opensim(counted, tmp_path / "out")}
    setups = {name: parse(tmp_path / "out" / name).getroot()[0] for name in files if "setup" in name}
    assert len(setups) == 4
    for name, tool in setups.items():
        named = [node.text for node in tool.iter() if node.tag.endswith(("_file", "_files", "filepath"))]
        assert len(named) > 2
        assert set(named) - {"walk_so_StaticOptimization_force.sto", "walk_id_opensim.sto"} <= files
        if "id" not in name:
            times = float(tool.findtext("initial_time")), float(tool.findtext("final_time"))
            assert times == pytest.approx((0.35 + 30 / 50, 0.35 + 50 / 50))


@pytest.mark.slow
@pytest.mark.opensim
@pytest.mark.real
def test_static_optimization_and_joint_reactions_run_unchanged_on_a_walk(recorded_fit, tmp_path):
    """Residual actuators within 1 N of the fit's residual, reserves below 5 % of a coordinate's peak."""
    pytest.importorskip("opensim")
    fit = recorded_fit("walk_rajagopal2015")
    (trial,) = fit.trials
    export_opensim(fit, tmp_path)
    run = "import opensim, sys; sys.exit(not all([opensim.AnalyzeTool(f).run() for f in sys.argv[1:]]))"
    command = [sys.executable, "-c", run, "walk_so_setup.xml", "walk_jra_setup.xml"]
    subprocess.run(command, cwd=tmp_path, check=True, env=os.environ)
    forces = read_storage(tmp_path / "walk_so_StaticOptimization_force.sto")
    dynamics, dofs = trial.dynamics, fit.skeleton.dofs
    rows = np.round((forces.times - dynamics.motion.times[0]) * dynamics.motion.rate).astype(int)
    assert dynamics.used[rows].sum() == len(rows) > 100
    torques = dict(zip(dofs, dynamics.joint_torques[rows].T, strict=True))
    push = np.linalg.norm([forces.column(f"pelvis_t{axis}_reserve") for axis in "xyz"], axis=0)
    ours = np.linalg.norm([torques[f"pelvis_t{axis}"] for axis in "xyz"], axis=0)
    assert np.sqrt(np.mean(push**2)) < np.sqrt(np.mean(ours**2)) + 1.0
    for name in [name for name in dofs if name.startswith(("hip", "knee", "ankle"))]:
        assert np.ptp(forces.column(f"{name}_reserve")) < 0.05 * np.abs(torques[name]).max(), name
    assert (tmp_path / "walk_jra_JointReaction_ReactionLoads.sto").is_file()
