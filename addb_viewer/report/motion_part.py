"""What the motion shows: figures of a walk or run, and what the fit to forces changed in it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean, stdev

import numpy as np

from addb_viewer.report.frames_kept import Kept
from addb_viewer.report.markup import Safe, element, joined, table
from addb_viewer.text.change_words import (
    READING,
    ChangeRow,
    bands_in_words,
    change_rows,
    change_sentence,
    limit_in_words,
)
from addb_viewer.text.diagnosis_vocabulary import newtons
from addb_viewer.text.residual_words import moment_Nm
from addb_viewer.trial_view.cause_pictures import pictures
from addb_viewer.trial_view.replay import Replay
from annotations.foot_names import foot_words
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.fitting.fit_summary import ChangeFigures, TrialFigures
from solver.gait.cycles import Cycle
from solver.gait.trial_gait import Gait

HEAD = ("Trial", "Foot", "Strides", "Cadence", "Speed", "Stride", "Step length", "Step width", "Stance")
FINE = (
    "A stride is from one contact of a foot to the next of the same foot; mean ± standard deviation. "
    "Contact and foot-off: the foot's vertical force crosses 20 N; where no plate measures the whole stance, "
    "they are found from how fast the sole moves over the ground. Step length and width: from the other heel "
    "at its last contact to this heel at the end of the stride, along and across the stride. Stance: from "
    "contact to foot-off, in percent of the stride time. On a treadmill the belt's travel is included. "
    "Definitions: Perry & Burnfield 2010."
)


MOST = 3
TELLING = 0.6  # share of the greatest unmeasured force from which on a frame shows it
GREATEST = 95  # percentile that counts as the greatest: single frames run away


def strides_part(gaits: Mapping[str, Gait]) -> Safe | None:
    """A row for each trial and foot; None where nobody takes a whole stride.

    Args:
        gaits: by trial.
    """
    rows = []
    for name, gait in gaits.items():
        for foot, body in enumerate(gait.feet):
            own = [cycle for cycle in gait.cycles if cycle.foot == foot]
            if own:
                rows.append([name, foot_words(body), str(len(own)), *_figures(own)])
    if not rows:
        return None
    return joined((element("h3", "Strides"), table(HEAD, rows), element("p", FINE, class_="fine")))


def _figures(cycles: Sequence[Cycle]) -> list[str]:
    return [
        _spread(cycles, lambda cycle: cycle.cadence_per_min, "steps/min", 0),
        _spread(cycles, lambda cycle: cycle.speed_m_s, "m/s", 2),
        _spread(cycles, lambda cycle: cycle.stride_length_m, "m", 2),
        _spread(cycles, lambda cycle: cycle.step_length_m, "m", 2),
        _spread(cycles, lambda cycle: cycle.step_width_m, "m", 2),
        _spread(
            cycles, lambda cycle: None if cycle.stance_share is None else 100 * cycle.stance_share, "%", 0
        ),
    ]


def _spread(cycles: Sequence[Cycle], figure: Callable[[Cycle], float | None], unit: str, digits: int) -> str:
    known = [value for value in map(figure, cycles) if value is not None]
    if not known:
        return ""
    spread = f" ± {stdev(known):.{digits}f}" if len(known) > 1 else ""
    return f"{mean(known):.{digits}f}{spread} {unit}"


def changed_part(trials: Sequence[TrialFigures]) -> Safe:
    """A sentence a trial, and its table one click away; empty where no trial was fitted to forces.

    Args:
        trials: in the shape of `fit --json`.
    """
    pieces = []
    for figures in trials:
        change = figures.change
        if change is None or not change_sentence(change):
            continue
        name = f"{figures.name}: " if len(trials) > 1 else ""
        pieces.append(element("p", f"{name}{change_sentence(change)}."))
        told = (
            "Root mean squares; the constant part and the bands add up as squares. Small: gain and phase "
            "against the markers' motion, where that has 0.2° or 1 mm there; a positive phase is early. "
            f"Range and peak speed of the fit; in brackets against {limit_in_words(change)}: more than that "
            "is faster movement that the fit keeps. Both leave out 0.1 s at the ends."
        )
        pieces.append(
            element(
                "details",
                element("summary", "By coordinate and frequency"),
                element("p", told, class_="fine"),
                _table(change),
            )
        )
    if not pieces:
        return Safe("")
    heading = element("h3", "What the fit to forces changed in the motion")
    return joined((heading, element("p", READING), *pieces))


def _table(change: ChangeFigures) -> Safe:
    head = ("Coordinate", "RMS", "constant", *bands_in_words(change), "Range", "Peak speed")
    return table(head, [_cells(row) for row in change_rows(change)], "changed")


def _cells(row: ChangeRow) -> list[str]:
    bands = [
        joined((rms, element("small", gain))) if gain else rms
        for rms, gain in zip(row.bands, row.gains, strict=True)
    ]
    return [row.coordinate, row.rms, row.offset, *bands, row.range, row.peak_speed]


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
