"""Each trial of a fit as a C3D file: what was measured, gait events, joint angles, torques and powers.

Markers and plates are the recorded ones, the plates at their own rate. Joint angles, torques and powers are
points that no camera saw, as laboratories' own model outputs are, listed in POINT:ANGLES and so on.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from solver.capture.capture import FootEvent
from solver.export.c3d_file import C3dRecording, ModelOutput, write_c3d
from solver.export.gait_tables import gaits_of
from solver.export.places import made, trial_stems
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.gait.events import Kind, side_of
from solver.gait.gait import Gait
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

NMM = 1000.0  # per N·m


@dataclass(frozen=True)
class _Kind:
    """What belongs to the coordinates of one kind of motion, and how it is listed."""

    group: Literal["ANGLES", "MOMENTS", "POWERS", "FORCES", "SCALARS"]
    motion: Literal["rotation", "translation"]
    unit: str
    suffix: str


ANGLES, TRANSLATIONS = (
    _Kind("ANGLES", "rotation", "deg", "angles"),
    _Kind("SCALARS", "translation", "m", "translations"),
)
MOMENTS, FORCES = (
    _Kind("MOMENTS", "rotation", "Nmm", "moments"),
    _Kind("FORCES", "translation", "N", "forces"),
)
POWERS = _Kind("POWERS", "rotation", "W", "powers")


def export_c3d(fit: Fit, folder: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Write TRIAL.c3d for every trial.

    Returns:
        The files written, and what they could not take as it was recorded.

    Raises:
        FitError, CaptureError: the folder cannot be made, or not written to.
    """
    written: list[Path] = []
    notes: list[str] = []
    stems, gaits = trial_stems(fit), gaits_of(fit)
    for trial in fit.trials:
        name = trial.capture.name
        recording = C3dRecording(
            markers=trial.capture.markers,
            plates=trial.capture.plates,
            events=foot_events(gaits[name]) if name in gaits else (),
            outputs=_outputs(trial, fit.skeleton),
            subject=fit.subject.name,
            mass_kg=fit.mass_kg,
            height_m=fit.height_m,
        )
        path = made(folder) / f"{stems[name]}.c3d"
        notes += write_c3d(path, recording)
        written.append(path)
    return written, tuple(notes)


def foot_events(gait: Gait) -> tuple[FootEvent, ...]:
    """Contacts and foot-offs by the names that C3D files give them."""
    return tuple(
        FootEvent(event.time_s, side_of(gait.feet[event.foot]), "Foot Strike" if contact else "Foot Off")
        for event in gait.events
        for contact in (event.kind is Kind.CONTACT,)
    )


def joint_outputs(
    skeleton: Skeleton, motion: Motion, torques: Float[np.ndarray, "frames dofs"] | None
) -> tuple[ModelOutput, ...]:
    """A point a joint and kind, its three values those of three coordinates in the order of the joint's axes.

    Args:
        skeleton: of the motion.
        motion: whose angles they are.
        torques: generalized forces; None: neither moments nor powers. The root's are the residual.
    """
    found = [*_points(skeleton, ANGLES, np.degrees(motion.q)), *_points(skeleton, TRANSLATIONS, motion.q)]
    if torques is not None:
        found += [*_points(skeleton, MOMENTS, NMM * torques), *_points(skeleton, FORCES, torques)]
        found += _points(skeleton, POWERS, torques * motion.velocity)
    return tuple(found)


def _outputs(trial: TrialFit, skeleton: Skeleton) -> tuple[ModelOutput, ...]:
    trial = without_guesses(trial)
    dynamics = trial.dynamics
    motion, torques = (dynamics.motion, dynamics.joint_torques) if dynamics else (trial.motion, None)
    points = joint_outputs(skeleton, motion, torques)
    return tuple(point for point in points if np.isfinite(point.values).all(axis=1).any())


def _points(
    skeleton: Skeleton, kind: _Kind, columns: Float[np.ndarray, "frames dofs"]
) -> Iterator[ModelOutput]:
    for joint, names in _coordinates(skeleton, kind.motion).items():
        for part in range(0, len(names), 3):
            three = names[part : part + 3]
            values = np.zeros((len(columns), 3))
            values[:, : len(three)] = columns[:, [skeleton.dofs.index(name) for name in three]]
            label = f"{joint}_{kind.suffix}" + (f"_{part // 3 + 1}" if part else "")
            described = ", ".join(f"{axis} {name}" for axis, name in zip("xyz", three, strict=False))
            yield ModelOutput(label, kind.group, kind.unit, values, described)


def _coordinates(skeleton: Skeleton, motion: str) -> dict[str, list[str]]:
    """By joint, its free coordinates of a kind in the order of its axes; each at the first joint it moves."""
    wanted = {c.name for c in skeleton.free_coordinates if c.motion == motion}
    found: dict[str, list[str]] = {}
    for joint in skeleton.joints:
        for axis in joint.axes:
            if axis.coordinate in wanted:
                wanted.discard(axis.coordinate)
                found.setdefault(joint.name, []).append(axis.coordinate)
    return found
