"""Which three frames of a trial are shown as still pictures, and what each of them tells."""

from dataclasses import dataclass

import numpy as np

from addb_viewer.report.frames_kept import Kept
from addb_viewer.text.diagnosis_vocabulary import newtons
from addb_viewer.text.residual_words import moment_Nm
from addb_viewer.trial_view.cause_pictures import pictures
from addb_viewer.trial_view.replay import Replay
from solver.diagnosis.diagnosis_report import DiagnosisReport

MOST = 3
TELLING = 0.6  # share of the greatest unmeasured force from which on a frame shows it
GREATEST = 95  # percentile that counts as the greatest: single frames run away


@dataclass(frozen=True)
class Moment:
    """A frame worth a picture."""

    frame: int
    heading: str
    why: str


def moments_of(replay: Replay, kept: Kept, diagnosis: DiagnosisReport | None) -> tuple[Moment, ...]:
    """At most three: what was left out, the largest residual, a named force; else ordinary frames.

    Args:
        replay: the trial.
        kept: its frames.
        diagnosis: of the recording; None where nobody asked.
    """
    found = [
        _left_out(replay, kept),
        _largest_residual(replay),
        _cause(replay, diagnosis),
        _usable(kept),
        _worst_marker(replay),
    ]
    return tuple([moment for moment in found if moment is not None][:MOST])


def _left_out(replay: Replay, kept: Kept) -> Moment | None:
    """Near the middle of the longest such stretch, where the motion demands a force that nobody measured.

    Of frames that show nobody there is no picture.
    """
    stretches = [
        (np.flatnonzero(replay.in_view[start:end]) + start, cause)
        for cause in kept.causes
        for start, end in cause.ranges
    ]
    stretches = [one for one in stretches if len(one[0])]
    if not stretches or not kept.count:
        return None
    frames, cause = max(stretches, key=lambda one: len(one[0]))
    up = np.zeros(replay.frames)
    for required in replay.required:
        if cause.foot in (None, required.foot):
            up = np.fmax(up, required.force[:, 1])
    inside = up[frames]
    telling = frames[inside >= TELLING * np.percentile(inside, GREATEST)]
    frame = int(telling[np.abs(telling - (frames[0] + frames[-1]) / 2).argmin()])
    why = f"{cause.foot_words}: {cause.words}."
    if up[frame] > 0:
        why += f" Dashed: the {newtons(float(up[frame]))} upwards that the motion demands there."
    return Moment(frame, "Left out", why)


def _largest_residual(replay: Replay) -> Moment | None:
    residual = replay.residual
    if residual is None or not residual.used.any():
        return None
    force, moment = np.linalg.norm(residual.force, axis=1), np.linalg.norm(residual.moment, axis=1)
    worst = np.fmax(force / residual.force_limit, moment / residual.moment_limit)
    frame = int(np.where(residual.used, worst, -1.0).argmax())
    why = (
        f"{newtons(float(force[frame]))} and {moment_Nm(float(moment[frame]))} are missing for F = ma: "
        f"{worst[frame]:.1f} times the bound."
    )
    return Moment(frame, "Largest residual", why)


def _cause(replay: Replay, diagnosis: DiagnosisReport | None) -> Moment | None:
    for picture in pictures(diagnosis, replay) if diagnosis else ():
        if picture.force is not None and picture.place is not None:
            size = np.linalg.norm(picture.force, axis=1)
            size = np.where(picture.acts & np.isfinite(size), size, -1.0)
            if size.max() > 0:
                frame = int(size.argmax())
                return Moment(frame, "The named cause", f"{picture.label}: {newtons(float(size[frame]))}.")
    return None


def _usable(kept: Kept) -> Moment | None:
    if not kept.count:
        return None
    start, end = max(kept.ranges, key=lambda r: r[1] - r[0])
    return Moment((start + end - 1) // 2, "Usable", "Middle of the longest usable stretch.")


def _worst_marker(replay: Replay) -> Moment | None:
    errors = replay.markers.errors
    if not np.isfinite(errors).any():
        return None
    frame, marker = np.unravel_index(np.nanargmax(errors), errors.shape)
    why = f"{replay.markers.names[marker]} is {100 * errors[frame, marker]:.1f} cm from its place."
    return Moment(int(frame), "Largest marker error", why)
