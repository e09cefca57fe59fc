"""One trial of a fit: the motion, torques, forces and residuals as named arrays."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from addb_viewer.api.labelled import AXES, Series, Table, UnknownNameError, analog_series, read_only
from solver.capture.formats.analog_channels import read_analog
from solver.common.notes import Note
from solver.export.gait_tables import UNITS
from solver.export.trial_table import trial_columns
from solver.fitting.fit_result import TrialFit
from solver.fitting.seen_part import in_view, without_guesses
from solver.gait.trial_gait import joint_power
from solver.kinematics.angle_conventions import CONVENTIONS, Convention, angles_by_convention
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

POWER_UNIT = "W"


class FittedTrial:
    """One trial of a fit. Everything is in the ground frame, y up; a time axis comes first.

    Torques and residuals belong to `coordinates`, the motion that they were computed on. A trial without
    dynamics (no usable motion for them) has empty series in their place. The series of coordinates and `com`
    have standard deviations, `std`, where the motion was fitted to forces.
    """

    def __init__(self, trial: TrialFit, skeleton: Skeleton) -> None:
        """As `Fit` makes it.

        Args:
            trial: solved.
            skeleton: of the fit.
        """
        self._trial, self._skeleton, self._drawn = without_guesses(trial), skeleton, in_view(trial)

    def __repr__(self) -> str:
        """Name and length."""
        used = f", forces used on {int(self.used.sum())}"
        return f"<FittedTrial '{self.name}': {self.frames} frames at {self.rate:g} Hz{used}>"

    @property
    def name(self) -> str:
        """The trial's name."""
        return self._trial.capture.name

    @property
    def frames(self) -> int:
        """Number of frames, those of the markers."""
        return self._motion.frames

    @property
    def rate(self) -> float:
        """Frames per second [Hz]."""
        return self._motion.rate

    @cached_property
    def times(self) -> np.ndarray:
        """Time of each frame on the recording's clock [s]; [frames]."""
        return read_only(self._motion.times)

    @property
    def notes(self) -> tuple[Note, ...]:
        """What was assumed, converted or ignored in this trial."""
        return (*self._trial.capture.notes, *self._trial.notes)

    @cached_property
    def used(self) -> np.ndarray:
        """Frames on which every foot's force was measured and counts, bool [frames]: the figures' frames."""
        dynamics = self._trial.dynamics
        return read_only(np.zeros(self.frames, bool) if dynamics is None else dynamics.used)

    @cached_property
    def coordinates(self) -> Series:
        """Generalized coordinates q [rad, m]; [frames, coordinates]."""
        return self._of_coordinates(self._motion.q, 0, "", "angle")

    def angles(self, convention: Convention) -> Series:
        """Joint angles [°] as others give them; [frames, angles], sides in their names: "hip_flexion_r".

        Args:
            convention: "cgm" (Plug-in Gait) or "isb" (Grood and Suntay), which
                `solver.kinematics.angle_conventions` describes.

        Raises:
            KeyError: no such convention.
        """
        if convention not in CONVENTIONS:
            raise UnknownNameError(convention, CONVENTIONS, "convention")
        found = angles_by_convention(self._skeleton, self._motion.q, convention)
        return self._series(np.stack([*found.values()], axis=1), [*found], ["deg"] * len(found))

    @cached_property
    def determined(self) -> Series:
        """Whether the frame's own markers show it, bool; else bridged or NaN; [frames, coordinates]."""
        left_open = self._trial.left_open
        shown = self._trial.motion.posed[:, None] & (True if left_open is None else ~left_open)
        names = self._skeleton.dofs
        return self._series(np.broadcast_to(shown, (self.frames, len(names))), names, [""] * len(names))

    @cached_property
    def velocities(self) -> Series:
        """Their first derivative [rad/s, m/s]; [frames, coordinates]."""
        return self._of_coordinates(self._motion.velocity, 0, "/s", "speed")

    @cached_property
    def accelerations(self) -> Series:
        """Their second derivative [rad/s², m/s²]; [frames, coordinates]."""
        return self._of_coordinates(self._motion.acceleration, 0, "/s²", "acceleration")

    @cached_property
    def torques(self) -> Series:
        """Generalized force of each coordinate [N·m, N], the root's included; [frames, coordinates]."""
        dynamics = self._trial.dynamics
        if dynamics is None:
            return self._nothing()
        return self._of_coordinates(dynamics.joint_torques, 1, "", "torque")

    @cached_property
    def powers(self) -> Series:
        """Torque times velocity [W], positive where the joint delivers work; [frames, coordinates]."""
        power = joint_power(self._trial)
        if power is None:
            return self._nothing()
        names = self._skeleton.dofs
        return self._series(power, names, [POWER_UNIT] * len(names), "power")

    @cached_property
    def residual_force(self) -> Series:
        """Force that is missing for F = ma [N]; x, y, z; [frames, 3]."""
        dynamics = self._trial.dynamics
        return self._nothing() if dynamics is None else self._along(dynamics.residual_root[:, :3], "N")

    @cached_property
    def residual_moment(self) -> Series:
        """Likewise the moment about the root joint's centre [N·m]; x, y, z; [frames, 3]."""
        dynamics = self._trial.dynamics
        return self._nothing() if dynamics is None else self._along(dynamics.residual_root[:, 3:], "Nm")

    @cached_property
    def com(self) -> Series:
        """The body's centre of mass [m]; x, y, z; [frames, 3]."""
        dynamics = self._trial.dynamics
        return self._nothing() if dynamics is None else self._along(dynamics.com_ground, "m", "com_ground")

    @cached_property
    def markers(self) -> Series:
        """Markers as measured [m], NaN where not seen, labels as the fit reads them; [frames, markers, 3]."""
        markers = self._trial.capture.markers
        return self._series(markers.positions_ground, markers.names, ["m"] * len(markers.names))

    @cached_property
    def analog(self) -> Series:
        """EMG, triggers and other channels that are no plate's, in the file's units; [samples, channels].

        Read from the recording now: raw, on a clock of their own, whose zero is the recording's.

        Raises:
            CaptureError: the recording cannot be read any more.
        """
        return analog_series(read_analog(self._trial.capture.files))

    @cached_property
    def model_markers(self) -> Series:
        """The skeleton's markers [m], those that the recording has as well; [frames, markers, 3]."""
        names = self._trial.marker_errors.names
        body_of = {marker.name: marker.body for marker in self._skeleton.markers}
        known = np.isfinite(self._poses[0]).all(axis=(2, 3))[:, [body_of[name] for name in names]]
        places = np.where(known[..., None], self._trial.model_markers_ground, np.nan)
        return self._series(places, names, ["m"] * len(names))

    @cached_property
    def marker_errors(self) -> Series:
        """Distance of each of these from the measured one [m], NaN where not seen; [frames, markers]."""
        errors = self._trial.marker_errors
        return self._series(errors.distance, errors.names, ["m"] * len(errors.names))

    @property
    def feet(self) -> tuple[str, ...]:
        """The bodies that forces act on; empty where none are known."""
        return self._trial.contacts.foot_bodies if self._trial.contacts else ()

    @cached_property
    def forces(self) -> Series:
        """Measured ground force on each foot [N], filtered as the motion is; [frames, feet, 3]."""
        contacts = self._trial.contacts
        return self._nothing() if contacts is None else self._on_feet(contacts.wrench_ground[:, :, :3], "N")

    @cached_property
    def moments(self) -> Series:
        """Likewise its moment about the ground origin [N·m]; [frames, feet, 3]."""
        contacts = self._trial.contacts
        return self._nothing() if contacts is None else self._on_feet(contacts.wrench_ground[:, :, 3:], "Nm")

    @cached_property
    def predicted_forces(self) -> Series:
        """Force under feet whose own is missing [N], else zero; [frames, feet, 3]."""
        contacts, dynamics, std = self._trial.contacts, self._trial.dynamics, self._trial.std
        if contacts is None or dynamics is None:
            return self._nothing()
        found = dynamics.wrench_predicted_ground
        values = np.zeros(contacts.wrench_ground.shape) if found is None else found
        off = std.predicted_force_ground if std is not None else None
        return replace(self._on_feet(values[:, :, :3], "N"), std=off)

    @cached_property
    def centres_of_pressure(self) -> Series:
        """Where the force acts [m], NaN where the foot is unloaded; [frames, feet, 3]."""
        contacts = self._trial.contacts
        return self._nothing() if contacts is None else self._on_feet(contacts.cop_ground, "m")

    @cached_property
    def counts(self) -> Series:
        """Where a foot's force counts, bool: nobody, and no detection, left it out; [frames, feet]."""
        mask = self._trial.mask
        return self._nothing() if mask is None else self._on_feet(mask.counts, "")

    @cached_property
    def left_out(self) -> Table:
        """Why forces do not count: a row a range, frames `start` to `end` − 1, which foot, who says so."""
        mask = self._trial.mask
        reasons = mask.reasons if mask else ()
        said_by = [mask.source_of(k) for k in range(len(reasons))] if mask else []
        return Table(
            {
                "start": np.array([start for start, *_ in reasons], dtype=int),
                "end": np.array([end for _, end, *_ in reasons], dtype=int),
                "foot": _texts([foot or "both" for _, _, foot, _ in reasons]),
                "reason": _texts([reason for *_, reason in reasons]),
                "said_by": _texts(said_by),
            }
        )

    @cached_property
    def proposals(self) -> Table:
        """What detection thinks of the forces: a row a range, its foot, the reason, how sure (0 to 1)."""
        found = self._trial.proposals
        return Table(
            {
                "start": np.array([p.range[0] for p in found], dtype=int),
                "end": np.array([p.range[1] for p in found], dtype=int),
                "foot": _texts([p.foot or "both" for p in found]),
                "reason": _texts([p.reason for p in found]),
                "confidence": np.array([p.confidence for p in found], dtype=float),
            }
        )

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the skeleton's bodies, a parent before its children."""
        return self._skeleton.body_names

    @cached_property
    def body_positions(self) -> Series:
        """Origin of each body's frame [m]; [frames, bodies, 3]."""
        return self._series(self._poses[1], self.bodies, ["m"] * len(self.bodies))

    @cached_property
    def body_rotations(self) -> np.ndarray:
        """R_ground_body, which takes a body's vectors to the ground's axes; [frames, bodies, 3, 3]."""
        return read_only(self._poses[0])

    @cached_property
    def table(self) -> Table:
        """All that has one value a frame, a column each with its unit: what `export --to csv` writes."""
        return Table(trial_columns(self._trial, self._skeleton))

    def to_polars(self) -> "pl.DataFrame":
        """`table` as a Polars frame."""
        return self.table.to_polars()

    def to_pandas(self) -> "pd.DataFrame":
        """`table` as a pandas frame."""
        return self.table.to_pandas()

    @cached_property
    def _motion(self) -> Motion:
        """The motion that torques and residuals were computed on."""
        return self._trial.dynamics.motion if self._trial.dynamics else self._trial.motion

    @cached_property
    def _poses(self) -> tuple[np.ndarray, np.ndarray]:
        drawn = self._drawn
        return body_poses(self._skeleton, (drawn.dynamics or drawn).motion.q)

    def _series(
        self, values: np.ndarray, names: Sequence[str], units: Sequence[str], std: str = ""
    ) -> Series:
        """With the standard deviations that `TrialStd` has under a name."""
        of_std = getattr(self._trial.std, std) if std and self._trial.std is not None else None
        return Series(values, tuple(names), tuple(units), self.times, of_std)

    def _of_coordinates(self, values: np.ndarray, kind: int, per: str, std: str) -> Series:
        units = [f"{UNITS[c.motion][kind].rsplit('_', 1)[-1]}{per}" for c in self._skeleton.free_coordinates]
        return self._series(values, self._skeleton.dofs, units, std)

    def _along(self, values: np.ndarray, unit: str, std: str = "") -> Series:
        return self._series(values, AXES, [unit] * len(AXES), std)

    def _on_feet(self, values: np.ndarray, unit: str) -> Series:
        return self._series(values, self.feet, [unit] * len(self.feet))

    def _nothing(self) -> Series:
        return self._series(np.zeros((self.frames, 0)), (), ())


def _texts(values: Sequence[Any]) -> np.ndarray:
    return np.array(values, dtype=object)
