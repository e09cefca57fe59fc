"""What a .b3d file says of its own passes, to stand beside what a fit of ours finds."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float

from solver.capture.formats.b3d.b3d_fields import B3dTrial, Header, PassFrames, PassHeader, PassType
from solver.common.notes import Kind, Note, noted

PASS_NAMES = {
    PassType.KINEMATICS: "kinematics",
    PassType.DYNAMICS: "dynamics",
    PassType.LOW_PASS_FILTER: "low-passed",
    PassType.ACCELERATION_MINIMIZING_FILTER: "smoothed accelerations",
}
GRAVITY_M_S2 = 9.81
USUAL_OFF_SHARE = (
    0.3  # of body weight: the root's forces are those of the usual reading, in the median over frames
)
CLEARLY_OFF_SHARE = 0.1  # of body weight, and
BETTER_RATIO = 0.5  # of what the usual reading misses: how well another one has to agree
USUAL_READING = (3, False)  # forces in the last three of the root's six, gravity along −y


@dataclass(frozen=True)
class StoredPass:
    """One pass of a trial as its file has it, frame by frame; NaN where it says nothing."""

    kind: str
    marker_rms_m: Float[np.ndarray, " frames"]
    force_N: Float[np.ndarray, " frames"]  # norm of the root's residual force
    moment_Nm: Float[np.ndarray, " frames"]  # norm of its residual torques about its Euler axes
    notes: tuple[Note, ...] = ()


def stored_passes(header: Header, segments: Sequence[B3dTrial]) -> tuple[StoredPass, ...]:
    """The passes that all segments of a trial have, put together.

    Which numbers are forces and which moments, and along which axis gravity acted, is weighed by the equation
    of motion, m (a − g) = forces + residual: files of 2023 have both exchanged.
    """
    count = min(len(segment.passes) for segment in segments)
    found = []
    for k in range(count):
        pieces = [
            _piece(
                header,
                segment.header.processing_pass_header[k],
                segment.passes[k],
                segment.header.trial_timestep,
            )
            for segment in segments
        ]
        found.append(
            StoredPass(
                kind=pieces[0].kind,
                marker_rms_m=np.concatenate([piece.marker_rms_m for piece in pieces]),
                force_N=np.concatenate([piece.force_N for piece in pieces]),
                moment_Nm=np.concatenate([piece.moment_Nm for piece in pieces]),
                notes=tuple(dict.fromkeys(note for piece in pieces for note in piece.notes)),
            )
        )
    return tuple(found)


def _piece(header: Header, about: PassHeader, frames: PassFrames, step_s: float) -> StoredPass:
    count = len(frames.pos)
    rms, linear, angular = (
        _series(values, count) for values in (about.marker_rms, about.linear_residual, about.angular_residual)
    )
    linear[[0, -1]] = angular[[0, -1]] = np.nan  # no acceleration is known there
    try:
        kind = PASS_NAMES[PassType(about.type)]
    except ValueError:
        kind = f"pass of type {about.type}"
    reading = _reading(header.mass_kg, frames, step_s)
    if reading is None:
        return StoredPass(kind, rms, linear, angular)
    forces, turned = reading
    weight = header.mass_kg * GRAVITY_M_S2
    tau = np.array(frames.tau[:, :6])
    notes: list[Note] = []
    own, other = tau[:, forces], tau[:, slice(3) if forces.start else slice(3, 6)]
    if _is_norm_of(linear, other) and not _is_norm_of(linear, own):
        linear, angular = angular, linear
        notes += noted(
            Kind.OTHER, "its linear and angular residuals are stored under each other's name; corrected here"
        )
    if turned:
        corrected = own + weight * np.array([0.0, 1.0, -1.0])
        linear = np.linalg.norm(corrected, axis=1)
        linear[[0, -1]] = np.nan
        angular = np.full(count, np.nan)
        notes += noted(
            Kind.OTHER,
            "its torques were computed with gravity along −z: the force is corrected, the moment is left out",
        )
    return StoredPass(kind, rms, linear, angular, tuple(notes))


def _series(values: np.ndarray, count: int) -> Float[np.ndarray, " frames"]:
    return np.array(values, dtype=float) if len(values) == count else np.full(count, np.nan)


def _reading(mass_kg: float, frames: PassFrames, step_s: float) -> tuple[slice, bool] | None:
    """Which of the first six of `tau` are forces, and whether gravity was along −z; None if neither fits."""
    if mass_kg <= 0 or len(frames.com_pos) < 5 or frames.tau.shape[1:] < (6,):
        return None
    places = np.array(frames.com_pos)
    acceleration = np.zeros_like(places)
    acceleration[1:-1] = (places[2:] - 2 * places[1:-1] + places[:-2]) / step_s**2
    force = np.array(frames.ground_contact_wrench).reshape(len(acceleration), -1, 6)[..., 3:].sum(axis=1)
    tau = np.array(frames.tau[:, :6])
    off: dict[tuple[int, bool], float] = {}
    for first, turned in product((3, 0), (False, True)):
        up = np.array([0.0, 0.0, 1.0]) if turned else np.array([0.0, 1.0, 0.0])
        required = mass_kg * (acceleration + GRAVITY_M_S2 * up) - force
        missed = np.linalg.norm(tau[:, first : first + 3] - required, axis=1)
        off[first, turned] = float(np.median(missed[2:-2]))
    weight = mass_kg * GRAVITY_M_S2
    best = min(off, key=lambda reading: off[reading])
    if off[best] >= min(CLEARLY_OFF_SHARE * weight, BETTER_RATIO * off[USUAL_READING]):
        best = USUAL_READING  # noise of markers hides a difference in unfiltered passes
        if not off[best] < USUAL_OFF_SHARE * weight:
            return None
    return slice(best[0], best[0] + 3), best[1]


def _is_norm_of(stated: Float[np.ndarray, " frames"], tau: Float[np.ndarray, "frames 3"]) -> bool:
    norm = np.linalg.norm(tau, axis=1)
    return (
        bool(np.nanmedian(np.abs(stated - norm)) < 1e-3 * np.nanmedian(norm) + 1e-6)
        if len(norm) > 2
        else False
    )
