"""Whether a fit will find room on the disk: asked once the recordings are read, before anything is fitted.

A fit's size follows from what goes into it: the recordings as read, and arrays as long as they are for every
coordinate, marker and foot. So a fit of that shape is made without figures, and told in bytes by the encoder
that would write it.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.atomic import clear_drafts
from solver.capture.capture import Capture
from solver.common.disk_errors import check_room
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.cross_validation.held_out import HeldOut
from solver.dynamics.dynamics import Dynamics, TrialStd
from solver.dynamics.trajectory.spline_basis import ORDER
from solver.fitting.fit_result import KinematicsOnly, TrialFit
from solver.fitting.results.codec import Encoder
from solver.fitting.settings import Settings
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

_FEET = 2  # that forces are given to
_MARGIN = 1.1  # notes and proposals may be longer than usual; without it real fits are 1 to 4 % smaller
_DIGITS = 20  # characters of a fitted number in JSON, with its sign
_SAID_OF_SUBJECT = 60_000  # [bytes] settings, names, notes, hashes and the summary; 15 to 45 kB in real fits
_SAID_OF_TRIAL = 6_000  # [characters] notes and proposals of a trial, at least
_SAID_OF_FRAME = 8  # [characters] likewise, of each frame: longer trials have more proposals
_LAYOUTS_OF_SECOND = 5_000  # [bytes] of blocks and steps held out; 4.8 to 5.2 kB in real fits
_BLOCK = 4096  # [bytes] that a file is rounded up to


def check_room_for_fit(
    folder: Path, skeleton: Skeleton, captures: Sequence[Capture], settings: Settings
) -> None:
    """Refuse a solve whose fit would not fit on the disk beside the one that it replaces.

    Args:
        folder: the results folder; need not exist.
        skeleton: the model with the markers that will be fitted.
        captures: the recordings that will be.
        settings: of the solve.

    Raises:
        CaptureError: there is less room.
    """
    clear_drafts(folder)
    check_room(folder, fit_size(skeleton, captures, settings), "this fit")


def fit_size(skeleton: Skeleton, captures: Sequence[Capture], settings: Settings) -> int:
    """How large the files of a fit will be [bytes]: not less than they are, and less than twice that.

    Args:
        skeleton: the model with the markers that will be fitted.
        captures: the recordings that will be.
        settings: of the solve.
    """
    skeletons = 2 * _fitted_json_size(skeleton)  # the fitted one, and that of the groundwork
    trials = sum(_trial_size(_without_figures(capture, skeleton, settings)) for capture in captures)
    size = skeletons + _SAID_OF_SUBJECT + trials + (len(captures) + 5) * _BLOCK
    if settings.trajectory.enabled and settings.trajectory.held_out:
        seconds = sum(capture.markers.frames / capture.markers.rate for capture in captures)
        size += round(_LAYOUTS_OF_SECOND * seconds)
    return round(_MARGIN * size)


def _fitted_json_size(skeleton: Skeleton) -> int:
    """Of the same skeleton once each number that is not 0 or 1 has all of its digits."""
    text = json.dumps(Encoder(Path(), inline=True).encode(skeleton), indent=2)
    return len(re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda n: _widened(n[0]), text).encode())


def _widened(number: str) -> str:
    return number if float(number) in (0.0, 1.0) else number.ljust(_DIGITS)


def _trial_size(trial: TrialFit) -> int:
    encoder = Encoder(trial.capture.files[0].parent if trial.capture.files else Path())
    said = len(json.dumps(encoder.encode(trial)))
    said += _SAID_OF_TRIAL + _SAID_OF_FRAME * trial.motion.frames
    return sum(array.nbytes for array in encoder.arrays.values()) + said * np.dtype("U1").itemsize


def _without_figures(capture: Capture, skeleton: Skeleton, settings: Settings) -> TrialFit:
    frames, dofs, markers = capture.markers.frames, len(skeleton.dofs), len(skeleton.markers)
    motion = Motion(skeleton.dofs, _blank(frames, dofs), capture.markers.rate)
    errors = MarkerErrors(skeleton.marker_names, _blank(frames, markers))
    fit = TrialFit(capture, motion, errors, _blank(frames, markers, 3))
    is_fitted = settings.trajectory.enabled and bool(capture.plates)
    per_frame, per_foot = _blank(frames, 6), _blank(frames, _FEET, 6)
    feet, flags = ("",) * _FEET, _blank(frames).astype(bool)
    counts, decided = _blank(frames, _FEET).astype(bool), _blank(frames, _FEET).astype(int)
    plate = _blank(frames, len(capture.plates)).astype(int)
    spacing = max(1, round(settings.trajectory.knot_spacing_s * motion.rate))
    return replace(
        fit,
        contacts=ContactWrenches(
            feet, per_foot, per_foot[:, :, :3], flags, counts, plate, per_foot, unassigned=flags
        ),
        mask=FrameMask(counts, decided_by=decided),
        dynamics=Dynamics(
            motion.q,
            per_frame,
            per_frame,
            per_frame[:, :3],
            per_frame[:, :3],
            flags,
            motion,
            counts,
            per_foot,
        ),
        kinematics_only=KinematicsOnly(motion, errors) if is_fitted else None,
        held_out=HeldOut(flags, per_frame, per_frame, (0.0, 0.0), per_frame) if is_fitted else None,
        spline=_blank(frames // spacing + ORDER, dofs) if is_fitted else None,
        std=TrialStd(*(motion.q,) * 5, per_frame[:, :3]) if is_fitted else None,
    )


def _blank(*shape: int) -> Float[np.ndarray, "..."]:
    """Zeros that take no memory."""
    return np.broadcast_to(0.0, shape)
