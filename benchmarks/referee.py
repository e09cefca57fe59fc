"""OpenSim's inverse dynamics as referee: its residual on the files that we export for it."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.formats.storage import read_storage


@dataclass(frozen=True)
class Verdict:
    """What OpenSim's InverseDynamicsTool finds."""

    times: Float[np.ndarray, " rows"]  # [s]
    residual_root: Float[
        np.ndarray, "rows 6"
    ]  # force [N], moment about the root joint's centre [N·m], ground frame
    torques: dict[str, Float[np.ndarray, " rows"]]  # [N·m or N] by coordinate


def referee(folder: Path, trial: str) -> Verdict:
    """Run OpenSim on an exported trial.

    Args:
        folder: what `export_opensim` wrote.
        trial: its files' stem.
    """
    import opensim  # noqa: PLC0415 (a test dependency that not every machine has)

    opensim.Logger.setLevelString("error")
    with _inside(folder):
        if not opensim.InverseDynamicsTool(f"{trial}_id_setup.xml").run():
            raise RuntimeError(f"OpenSim's inverse dynamics of {folder / trial} failed")
    forces = read_storage(folder / f"{trial}_id_opensim.sto")
    motion = read_storage(folder / f"{trial}_ik.mot")
    model = opensim.Model(str(folder / "model.osim"))
    state = model.initSystem()
    coordinates = [model.getCoordinateSet().get(i) for i in range(model.getCoordinateSet().getSize())]
    torques = {}
    for coordinate in coordinates:
        name = coordinate.getName()
        label = next(x for x in (f"{name}_moment", f"{name}_force") if x in forces.labels)
        torques[name] = forces.column(label)
    root = _Root(model, opensim)
    rows = np.round((forces.times - motion.times[0]) * motion.rate).astype(int)
    residual = []
    for k, row in enumerate(rows):
        for coordinate in root.coordinates:
            coordinate.setValue(state, motion.column(coordinate.getName())[row], False)
        generalized = np.array([torques[c.getName()][k] for c in root.coordinates])
        residual.append(np.linalg.solve(root.jacobian(state).T, generalized))
    return Verdict(forces.times, np.array(residual), torques)


class _Root:
    """The joint between ground and pelvis, as OpenSim moves it."""

    def __init__(self, model, opensim) -> None:
        self.model = model
        joints = [model.getJointSet().get(i) for i in range(model.getJointSet().getSize())]
        joint = next(j for j in joints if j.getParentFrame().findBaseFrame().getName() == "ground")
        child = joint.getChildFrame()
        self.body = opensim.Body.safeDownCast(child.findBaseFrame())
        self.centre_body = child.findTransformInBaseFrame().p()
        self.coordinates = [joint.get_coordinates(i) for i in range(joint.numCoordinates())]

    def jacobian(self, state) -> Float[np.ndarray, "6 6"]:
        """Velocity of the joint's centre and angular velocity by each coordinate's speed; ground frame."""
        columns = []
        for moving in self.coordinates:
            for c in self.coordinates:
                c.setSpeedValue(state, 1.0 if c is moving else 0.0)
            self.model.realizeVelocity(state)
            linear = self.body.findStationVelocityInGround(state, self.centre_body)
            angular = self.body.getAngularVelocityInGround(state)
            columns.append([linear.get(i) for i in range(3)] + [angular.get(i) for i in range(3)])
        return np.array(columns).T


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """OpenSim writes where it stands."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
