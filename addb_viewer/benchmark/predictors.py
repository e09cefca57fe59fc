"""Predictors by name, and those of others by file; among them the baseline without training."""

import importlib.util
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.benchmark.from_angles import FromAngles
from addb_viewer.benchmark.scoring import CUTOFF_HZ
from addb_viewer.benchmark.task import (
    BenchmarkError,
    Log,
    Predicted,
    Predictor,
    Seen,
    Trials,
    central_differences,
)
from solver.common.filters import low_pass
from solver.contact.contact_phases import touching
from solver.contact.settings import ContactSettings
from solver.contact.sole import soles
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel

LOW_M = (
    0.1  # of a foot body's origin above the lowest one: on the ground (as the paper's public tools have it)
)

ContactRule = Literal["height", "soles"]


@dataclass(frozen=True)
class Analytical:
    """Total force m (z̈ − g), in equal parts on the feet that are on the ground; no moment."""

    name: str = "analytical"
    cutoff_Hz: float | None = None  # of the motion, before it is differenced; None: unfiltered
    contact: ContactRule = "height"  # of the feet's origins; or by the soles' height and speed

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Nothing is learnt."""

    def predict(self, seen: Seen) -> Predicted:
        """See the class."""
        q = seen.q if self.cutoff_Hz is None else low_pass(seen.q, seen.rate, self.cutoff_Hz)
        velocity, acceleration = central_differences(q, seen.rate)
        model = RigidBodyModel(seen.skeleton)
        com = model.centre_of_mass_acceleration(q, velocity, acceleration)
        total = seen.mass_kg * (com - seen.skeleton.gravity)
        on_ground = feet_on_ground(replace(seen, q=q), self.contact)
        share = on_ground / np.maximum(on_ground.sum(axis=1, keepdims=True), 1)
        force = share[:, :, None] * total[:, None, :]
        return Predicted(force, np.zeros_like(force), acceleration=acceleration, velocity=velocity, q=q)


def feet_on_ground(seen: Seen, rule: ContactRule) -> Bool[np.ndarray, "frames feet"]:
    """Which feet are on the ground, by motion alone.

    Args:
        seen: the motion.
        rule: "height": the foot body's origin is less than 0.1 m above the lowest of the stretch; "soles": a
            corner of the sole is as low as the sole gets, and moves with the ground or belt.
    """
    R, p = body_poses(seen.skeleton, seen.q)
    if rule == "height":
        height: Float[np.ndarray, "frames feet"] = p[:, list(seen.feet), 1]
        return height < height.min() + LOW_M
    corners = [sole.corners_ground(R, p) for sole in soles(seen.skeleton, seen.foot_bodies)]
    nobody = np.zeros((seen.frames, len(corners)), dtype=bool)
    return touching(corners, nobody, seen.rate, ContactSettings())


def filtered(cutoff_Hz: float = CUTOFF_HZ, contact: ContactRule = "height") -> Analytical:
    """The same on filtered motion.

    Args:
        cutoff_Hz: of the filter of order 3, forwards and backwards.
        contact: as in `Analytical`.
    """
    name = f"analytical-{cutoff_Hz:g}Hz" + ("-soles" if contact == "soles" else "")
    return Analytical(name, cutoff_Hz, contact)


@dataclass
class FromMarkers:
    """Fits one trajectory to the markers and to what `FromAngles` predicts; then predicts along it."""

    name: str = "fit-from-markers"
    angles: FromAngles = field(default_factory=FromAngles)
    needs_markers: bool = True

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """As from angles."""
        self.angles.fit(train, dev, log)

    def predict(self, seen: Seen) -> Predicted:
        """See the class; a stretch that is too short for a trajectory is told from its angles."""
        shown = Motion(seen.skeleton.dofs, seen.q, seen.rate)
        enough = seen.frames >= self.angles.settings.trajectory.fewest_frames
        return self.angles.along(seen, self._trajectory(seen, shown) if enough else shown)

    def _trajectory(self, seen: Seen, shown: Motion) -> Motion:
        if seen.markers is None:
            raise BenchmarkError(f"{self.name} needs markers, and this release shows none")
        there = seen.markers.names
        markers = [marker for marker in seen.skeleton.markers if marker.name in there]
        data = TrialData(
            observed_ground=seen.markers.position_ground[:, [there.index(m.name) for m in markers]],
            wrench_ground=np.zeros((seen.frames, 6)),
            counts=np.zeros(seen.frames, dtype=bool),
            start=shown,
            predicted_ground=self.angles.total_wrench(seen, shown, self.angles.cutoff_Hz),
        )
        skeleton = replace(seen.skeleton, markers=tuple(markers))
        return fit_trajectories(skeleton, [data], self.angles.settings.trajectory).motions[0]


_ANALYTICAL = re.compile(r"analytical-(\d+(?:\.\d+)?)Hz(-soles)?")


@dataclass(frozen=True)
class Learning:
    """What networks learn from beside the persons; other predictors do not ask."""

    features: Literal["plain", "wide"] = "plain"
    start_from: Path | None = None  # results of an earlier evaluation


def _learnt(name: str, learning: Learning) -> Predictor:
    if importlib.util.find_spec("torch") is None:
        raise BenchmarkError(f"{name} needs PyTorch; install it: pip install 'addb-viewer[benchmark]'")
    from addb_viewer.benchmark.learnt.predictor import learnt  # noqa: PLC0415 (loads PyTorch)

    return learnt(name, features=learning.features, start=learning.start_from)


BY_NAME: dict[str, Callable[[], Predictor]] = {
    "analytical": Analytical,
    "analytical-30Hz": filtered,
    "fit-from-angles": FromAngles,
    "fit-from-markers": FromMarkers,
    "analytical-30Hz-soles": lambda: filtered(contact="soles"),
}
LEARNT = ("mlp", "groundlinknet")


def predictor(name: str, learning: Learning = Learning()) -> Predictor:
    """A predictor.

    Args:
        name: one of `BY_NAME` or `LEARNT`; analytical-NHz for another cutoff; or FILE.py:CLASS, which is
            made without arguments.
        learning: of `LEARNT`.

    Raises:
        BenchmarkError: there is none.
    """
    if name in BY_NAME:
        return BY_NAME[name]()
    if name in LEARNT:
        return _learnt(name, learning)
    if match := _ANALYTICAL.fullmatch(name):
        return filtered(float(match[1]), "soles" if match[2] else "height")
    if ".py:" in name:
        return _from_file(*name.rsplit(":", 1))
    raise BenchmarkError(
        f"no predictor '{name}'; there are {', '.join((*BY_NAME, *LEARNT))}, or FILE.py:CLASS"
    )


def _from_file(file: str, name: str) -> Predictor:
    path = Path(file)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise BenchmarkError(f"{file}: no such file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not hasattr(module, name):
        raise BenchmarkError(f"{file}: it has no class '{name}'")
    made: Predictor = getattr(module, name)()
    for wanted in ("name", "fit", "predict"):
        if not hasattr(made, wanted):
            raise BenchmarkError(
                f"{file}: {name} has no '{wanted}'; docs/how-to/benchmark.md shows what it needs"
            )
    return made
