"""OpenSim as the referee of the skeleton: the same model, the same state, its own numbers."""

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Skeleton

NOT_SKELETON = ("ForceSet", "ControllerSet", "ProbeSet", "ContactGeometrySet")


@dataclass(frozen=True)
class Mapped:
    """Every coordinate as a function of q: value, velocity, acceleration, and D = ∂(coordinates)/∂q."""

    value: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    D: np.ndarray


class Referee:
    """An OpenSim model that takes states in the skeleton's q."""

    def __init__(self, opensim, path: Path, skeleton: Skeleton) -> None:
        self.opensim, self.skeleton = opensim, skeleton
        self.model = opensim.Model(str(path))
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()
        self.coordinates = [self.model.getCoordinateSet().get(i) for i in range(self.count)]

    @property
    def count(self) -> int:
        return self.model.getCoordinateSet().getSize()

    @cached_property
    def mobility(self) -> list[int]:
        """Index of each coordinate among Simbody's mobilities."""
        indices = []
        for coordinate in self.coordinates:
            self.state.updU().setToZero()
            coordinate.setSpeedValue(self.state, 1.0)
            indices.append(int(np.argmax(self.state.getU().to_numpy())))
        assert sorted(indices) == list(range(self.count))
        return indices

    def mapped(self, q, v, a) -> Mapped:
        """Couplings and locks applied, independently of the chain."""
        table = {c.name: c for c in self.skeleton.coordinates}
        value, curvature = np.zeros(self.count), np.zeros(self.count)
        D = np.zeros((self.count, len(q)))

        def follow(name):
            c = table[name]
            if c.locked:
                return c.default, None, 0.0, 0.0
            if c.coupling is None:
                i = self.skeleton.dofs.index(name)
                return q[i], i, 1.0, 0.0
            x, i, dx, ddx = follow(c.coupled_to)
            f, df, ddf = (float(part[0]) for part in c.coupling(np.array([x])))
            return f, i, df * dx, ddf * dx**2 + df * ddx

        for k, c in enumerate(self.skeleton.coordinates):
            value[k], i, slope, bend = follow(c.name)
            if i is not None:
                D[k, i], curvature[k] = slope, bend * v[i] ** 2
        return Mapped(value, D @ v, D @ a + curvature, D)

    def pose(self, q, v=None) -> Mapped:
        """Put the model into a state."""
        still = np.zeros_like(q)
        mapped = self.mapped(q, still if v is None else v, still)
        for k, mobility in enumerate(self.mobility):
            self.state.updQ().set(mobility, mapped.value[k])
            self.state.updU().set(mobility, mapped.velocity[k])
        self.model.realizeVelocity(self.state)
        return mapped

    def body(self, name) -> tuple[np.ndarray, np.ndarray]:
        X = self.model.getBodySet().get(name).getTransformInGround(self.state)
        return np.array([[X.R().get(i, j) for j in range(3)] for i in range(3)]), X.p().to_numpy()

    def markers(self) -> np.ndarray:
        markers = self.model.getMarkerSet()
        names = self.skeleton.marker_names
        return np.array([markers.get(n).getLocationInGround(self.state).to_numpy() for n in names])

    def mass_matrix(self, q) -> np.ndarray:
        D = self.pose(q).D
        M = self.opensim.Matrix()
        self.matter.calcM(self.state, M)
        return D.T @ M.to_numpy()[np.ix_(self.mobility, self.mobility)] @ D

    def torques(self, q, v, a, *, body: str, stations, forces) -> tuple[np.ndarray, np.ndarray]:
        """Φ'ᵀ τ with forces at stations of a body, and the wrench they make about the ground origin."""
        self.pose(q, v)
        mapped = self.mapped(q, v, a)
        acceleration = self.opensim.Vector(self.count, 0.0)
        for k, mobility in enumerate(self.mobility):
            acceleration.set(mobility, mapped.acceleration[k])
        solver = self.opensim.InverseDynamicsSolver(self.model)
        tau = solver.solve(self.state, acceleration).to_numpy()
        R, origin = self.body(body)
        index = self.model.getBodySet().get(body).getMobilizedBodyIndex()
        wrench = np.zeros(6)
        for station, force in zip(stations, forces, strict=True):
            pulled = self.opensim.Vector(self.count, 0.0)
            self.matter.multiplyByStationJacobianTranspose(
                self.state, index, self.opensim.Vec3(*station), self.opensim.Vec3(*force), pulled
            )
            tau = tau - pulled.to_numpy()
            wrench += np.concatenate([force, np.cross(origin + R @ station, force)])
        return mapped.D.T @ tau[self.mobility], wrench

    def scale(self, factors, mass_kg) -> None:
        """OpenSim's own scaling, masses keeping their distribution."""
        scales = self.opensim.ScaleSet()
        for name, factor in zip(self.skeleton.body_names, factors, strict=True):
            scale = self.opensim.Scale()
            scale.setSegmentName(name)
            scale.setScaleFactors(self.opensim.Vec3(*factor))
            scale.setApply(True)
            scales.cloneAndAppend(scale)
        self.model.scale(self.state, scales, True, mass_kg)
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()


@pytest.fixture(scope="session")
def opensim():
    module = pytest.importorskip(
        "opensim", reason="OpenSim's wheel is not installed; pip install .[reference]"
    )
    module.Logger.setLevelString("Error")
    module.Logger.removeFileSink()  # it would leave an opensim.log where the tests run
    return module


@pytest.fixture(scope="session")
def referee(opensim) -> Callable[[Path, Skeleton], Referee]:
    return lambda path, skeleton: Referee(opensim, path, skeleton)


@pytest.fixture(scope="session")
def model_files(real_data) -> list[Path]:
    """Every model beside the recordings, each content once."""
    first: dict[bytes, Path] = {}
    for path in sorted(real_data.rglob("*.osim")):
        first.setdefault(hashlib.sha256(path.read_bytes()).digest(), path)
    return list(first.values())


@pytest.fixture(scope="session")
def without_muscles(tmp_path_factory) -> Callable[[Path], Path]:
    """A copy of a model without its muscles, which take OpenSim longer than all the rest."""
    folder = tmp_path_factory.mktemp("without_muscles")

    def strip(path):
        text = path.read_text(encoding="utf-8", errors="replace")
        for tag in NOT_SKELETON:
            text = re.sub(rf"<{tag}\b[^>]*?(/>|>.*?</{tag}>)", "", text, flags=re.DOTALL)
        bare = folder / f"{len(list(folder.iterdir()))}.osim"
        bare.write_text(text, encoding="utf-8")
        return bare

    return strip


@pytest.fixture(scope="session")
def referees(referee, model_files, without_muscles) -> dict[Path, Referee]:
    """The models that we support, opened in OpenSim."""
    supported = [path for path in model_files if "ScapulothoracicJoint" not in path.name]
    assert supported
    return {path: referee(without_muscles(path), load_skeleton(path)) for path in supported}


@pytest.fixture(scope="session")
def random_q() -> Callable[[Skeleton, np.random.Generator], np.ndarray]:
    """Admissible coordinates: inside their ranges, and no further than a radian or metre and a half."""

    def draw(skeleton, rng):
        bounds = np.array([c.range for c in skeleton.free_coordinates])
        return rng.uniform(np.maximum(bounds[:, 0], -1.5), np.minimum(bounds[:, 1], 1.5))

    return draw
