"""Our own entry: what the solver says of a trial without force plates, from angles alone."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.benchmark.scoring import ErrorBands, error_bands, scored_frames
from addb_viewer.benchmark.task import Example, Log, Predicted, Seen, Trials
from solver.capture.plates.conditioning import shared_cutoff
from solver.dynamics.force_prediction.divided_wrench import feet_moving_with_ground, press_on_soles
from solver.dynamics.force_prediction.missing_wrench import predict_ground_forces
from solver.dynamics.root_wrench import root_wrench
from solver.fitting.settings import Settings
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel

# Of the smoothing, and of the soles that presses: chosen by persons who are not tested.
CUTOFFS_HZ = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0)
REACHES = (1.0, 0.75, 0.5)
MOST_STRETCHES = 200  # that choose the cutoff
FEWER_STRETCHES = 60  # that choose the reach, and show the errors


@dataclass
class FromAngles:
    """Smoothed momentum that the ground only pushes, nothing in flight; divided between the soles."""

    name: str = "fit-from-angles"
    settings: Settings = field(default_factory=Settings, repr=False)
    cutoff_Hz: float = 5.0  # of the smoothing, until `fit` has chosen it
    reach: float = 1.0  # of the soles, about their middle, likewise
    bands: ErrorBands | None = field(default=None, repr=False)  # likewise; None: no standard deviations
    _known: dict[tuple[object, ...], Any] = field(default_factory=dict, repr=False)
    """What does not change from fold to fold: errors and answers of stretches that choose."""

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Choose the cutoff by the total force of others, the soles' reach by the feet's."""
        some: list[Example] = []
        totals = _means(_keeping(islice(chain(dev, train), MOST_STRETCHES), some), self._missed)
        if totals is None:
            return
        self.cutoff_Hz = CUTOFFS_HZ[int(np.argmin(totals))]
        of_feet = _means(some, self._missed_by_feet)
        if of_feet is not None:
            self.reach = REACHES[int(np.argmin(of_feet))]
        log(cutoff_Hz=self.cutoff_Hz, reach=self.reach)
        self.bands = error_bands(self._answered, some)

    def predict(self, seen: Seen) -> Predicted:
        """See the class."""
        predicted = self._answer(seen)
        if self.bands is None:
            return predicted
        return replace(predicted, force_sd=self.bands.of(predicted.force, seen.mass_kg))

    def _answer(self, seen: Seen) -> Predicted:
        return self.along(seen, Motion(seen.skeleton.dofs, seen.q, seen.rate))

    def along(self, seen: Seen, motion: Motion) -> Predicted:
        """Along a motion; moments are about the feet's origins as they are shown.

        Args:
            seen: what is shown.
            motion: of the same frames.
        """
        smooth = motion.low_passed(self.cutoff_Hz)
        total = self.total_wrench(seen, motion, self.cutoff_Hz)
        carry = feet_moving_with_ground(
            seen.skeleton,
            seen.foot_bodies,
            smooth.q,
            total,
            rate=seen.rate,
            speed_m_s=self.settings.contact.touch_speed_m_s,
        )
        wrenches = press_on_soles(seen.skeleton, seen.foot_bodies, smooth.q, total, carry, reach=self.reach)
        feet = body_poses(seen.skeleton, seen.q)[1][:, list(seen.feet)]
        force = wrenches[..., :3]
        return Predicted(force, wrenches[..., 3:] - np.cross(feet, force), q=smooth.q)

    def total_wrench(self, seen: Seen, motion: Motion, cutoff_Hz: float) -> Float[np.ndarray, "frames 6"]:
        """Of both feet together [N, N·m about the ground origin].

        Args:
            seen: what is shown.
            motion: of the same frames.
            cutoff_Hz: of the smoothing.
        """
        demand, com = self._required(seen, motion)
        return predict_ground_forces(demand, com, seen.rate, cutoff_Hz).wrench_ground

    def _required(
        self, seen: Seen, motion: Motion
    ) -> tuple[Float[np.ndarray, "frames 6"], Float[np.ndarray, "frames 3"]]:
        """What the motion asks of the ground, hardly filtered; and the centre of mass."""
        cutoff = shared_cutoff(seen.rate, self.settings.conditioning)
        gentle = motion.low_passed(cutoff, self.settings.conditioning.order)
        model, root = RigidBodyModel(seen.skeleton), root_joint(seen.skeleton)
        torque = model.inverse_dynamics(gentle.q, gentle.velocity, gentle.acceleration)
        kinematics = ForwardKinematics(seen.skeleton)
        demand = root_wrench(root, kinematics.chain, kinematics.poses(gentle.q), torque)
        return demand, model.centre_of_mass(gentle.q)

    def _missed(self, example: Example, counts: Bool[np.ndarray, " frames"]) -> list[float]:
        """Mean error of the total force over some frames, at each cutoff [N/kg]."""
        key = ("total", *_key(example))
        if key not in self._known:
            seen, measured = example.seen, example.measured
            demand, com = self._required(seen, Motion(seen.skeleton.dofs, seen.q, seen.rate))
            errors = []
            for cutoff in CUTOFFS_HZ:
                total = predict_ground_forces(demand, com, seen.rate, cutoff).wrench_ground[:, :3]
                off = np.linalg.norm(total - measured.force.sum(axis=1), axis=1)
                errors.append(float(off[counts].mean()) / measured.mass_kg)
            self._known[key] = errors
        known: list[float] = self._known[key]
        return known

    def _missed_by_feet(self, example: Example, counts: Bool[np.ndarray, " frames"]) -> list[float]:
        """Mean error of each foot's force over some frames, at each reach of the soles [N/kg]."""
        errors = []
        for reach in REACHES:
            off = replace(self, reach=reach)._answered(example).force - example.measured.force
            errors.append(float(np.linalg.norm(off, axis=2)[counts].mean()) / example.measured.mass_kg)
        return errors

    def _answered(self, example: Example) -> Predicted:
        key = ("answer", self.cutoff_Hz, self.reach, *_key(example))
        if key not in self._known:
            self._known[key] = self._answer(example.seen)
        known: Predicted = self._known[key]
        return known


def _key(example: Example) -> tuple[str, int]:
    return example.trial_id, int(example.frame[0])


def _keeping(examples: Iterable[Example], kept: list[Example]) -> Iterator[Example]:
    """The same, of which the first FEWER_STRETCHES are kept: a release is read once."""
    for example in examples:
        if len(kept) < FEWER_STRETCHES:
            kept.append(example)
        yield example


def _means(
    examples: Iterable[Example], missed: Callable[[Example, Bool[np.ndarray, " frames"]], list[float]]
) -> Float[np.ndarray, " choices"] | None:
    """Errors of several choices over persons, each weighing alike; None where nothing was measured."""
    errors: dict[str, list[list[float]]] = defaultdict(list)
    for example in examples:
        counts = scored_frames(example.measured.counts)
        if counts.any():
            errors[example.person_id].append(missed(example, counts))
    if not errors:
        return None
    return np.asarray(np.mean([np.mean(own, axis=0) for own in errors.values()], axis=0))
