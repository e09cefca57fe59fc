"""Curves over a trial in a rerun recording: residuals, marker errors and thresholds, plate forces, joints.

series/residual_force/after, before, threshold     [N]
series/residual_moment/…                           [N·m] about the root joint's centre
series/marker_error/…                              [cm] RMS and largest of each frame
series/vertical_force/NAME                         [N] of each plate
series/analog/NAME                                 channels of no plate, sample by sample, in the file's unit
series/joint_angle/NAME, joint_torque/NAME         [°], [N·m] in words: knee_flexion_torque, both sides
"""

from collections.abc import Sequence

import numpy as np
import rerun as rr
from jaxtyping import Float

from addb_viewer.recordings.rrd_scene import AFTER, BEFORE
from addb_viewer.recordings.rrd_stream import RrdStream
from addb_viewer.trial_view.drawn_curves import marker_errors_of, used_norm
from addb_viewer.trial_view.joint_quantities import JointQuantity, Kind, quantities_of
from addb_viewer.trial_view.palette import BLUE, GREY, OTHER_SOLVE, PLATES, RESIDUAL, Rgb
from addb_viewer.trial_view.recorded_subject import TrialRecord
from addb_viewer.trial_view.replay import JointReplay, ResidualReplay
from solver.capture.formats.analog_channels import AnalogChannels
from solver.dynamics.thresholds import Thresholds

SERIES = "series"
FORCE, MOMENT, MARKERS, VERTICAL = "residual_force", "residual_moment", "marker_error", "vertical_force"
ANALOG = "analog"
JOINTS = {Kind.POSITION: "joint_angle", Kind.TORQUE: "joint_torque"}
THRESHOLD = "threshold"
CENTIMETRES = 100.0  # in a metre
PALE_LEFT = 0.5  # share of white in the colour of a left joint


def write_series(stream: RrdStream, record: TrialRecord) -> None:
    """Write a trial's curves; on frames whose forces do not count, residuals have a gap.

    Args:
        stream: of the trial.
        record: the trial.
    """
    replay, before = record.replay, record.before
    solves = [(AFTER, "fit", replay, 2.0)]
    if before is not None:
        solves.append((BEFORE, record.before_name, before, 1.0))
    for which, label, shown, width in solves:
        tint = RESIDUAL if which == AFTER else OTHER_SOLVE
        if shown.residual is not None:
            _residual(stream, which, shown.residual, _Pen(label, tint, width))
        rms, largest = marker_errors_of(shown.markers)
        tint = BLUE if which == AFTER else OTHER_SOLVE
        _curve(stream, (SERIES, MARKERS, which), CENTIMETRES * rms, _Pen(f"{label}, RMS", tint, width))
        if which == AFTER:
            pen = _Pen(f"{label}, largest", GREY, 1.0)
            _curve(stream, (SERIES, MARKERS, "largest"), CENTIMETRES * largest, pen)
    if replay.residual is not None:
        _threshold(stream, FORCE, replay.residual.force_limit)
        _threshold(stream, MOMENT, replay.residual.moment_limit)
    if replay.bodies is not None:
        _threshold(stream, MARKERS, CENTIMETRES * Thresholds().marker_rms_m)
    for i, plate in enumerate(replay.plates):
        pen = _Pen(plate.name, PLATES[i % len(PLATES)], 1.5)
        _curve(stream, (SERIES, VERTICAL, plate.name), plate.force[:, 1], pen)
    if record.analog[0] is not None:
        _analog(stream, record.analog[0])
    if replay.joints is not None:
        _joints(stream, replay.joints)


def joint_quantities(joints: JointReplay) -> list[JointQuantity]:
    """Angles and torques of all joints."""
    found = (q for q in quantities_of(joints) if q.kind in JOINTS)
    return [quantity for quantity in found if quantity.unit in ("°", "N·m")]


def joint_parts(quantity: JointQuantity) -> tuple[str, str, str]:
    """Of which entity its curves are."""
    return SERIES, JOINTS[quantity.kind], quantity.named("")


class _Pen:
    """How a curve looks."""

    def __init__(self, name: str, color: Rgb, width: float) -> None:
        self.line = rr.SeriesLines(names=[name], colors=[list(color)], widths=[width])


def _joints(stream: RrdStream, joints: JointReplay) -> None:
    """A colour a joint; the left side is pale."""
    quantities = joint_quantities(joints)
    stems = list(dict.fromkeys(quantity.stem for quantity in quantities))
    for quantity in quantities:
        color = PLATES[stems.index(quantity.stem) % len(PLATES)]
        pale = Rgb(*(round(c + PALE_LEFT * (255 - c)) for c in color))
        names = [quantity.told(side) for side, _ in quantity.columns]
        tints = [list(pale if side == "left" else color) for side, _ in quantity.columns]
        values = np.stack([quantity.values(joints, column) for _, column in quantity.columns], axis=1)
        line = rr.SeriesLines(names=names, colors=tints, widths=[1.5] * len(names))
        _lines(stream, joint_parts(quantity), values, line)


def _analog(stream: RrdStream, analog: AnalogChannels) -> None:
    for k, (name, unit) in enumerate(zip(analog.names, analog.units, strict=True)):
        parts = (SERIES, ANALOG, name)
        label = f"{name} [{unit}]" if unit else name
        stream.static(parts, _Pen(label, PLATES[k % len(PLATES)], 1.0).line)
        stream.samples(parts, rr.Scalars.columns(scalars=analog.values[:, k]), analog.times)


def _residual(stream: RrdStream, which: str, residual: ResidualReplay, pen: _Pen) -> None:
    _curve(stream, (SERIES, FORCE, which), used_norm(residual.force, residual), pen)
    _curve(stream, (SERIES, MOMENT, which), used_norm(residual.moment, residual), pen)


def _curve(stream: RrdStream, parts: Sequence[str], values: Float[np.ndarray, " frames"], pen: _Pen) -> None:
    _lines(stream, parts, values[:, None], pen.line)


def _lines(
    stream: RrdStream, parts: Sequence[str], values: Float[np.ndarray, "frames lines"], look: rr.SeriesLines
) -> None:
    """NaN is a gap: a row without a value ends the lines."""
    known = np.isfinite(values).all(axis=1)
    if not known.any():
        return
    stream.static(parts, look)
    rows = np.flatnonzero(known | np.r_[False, known[:-1]])  # and the first one of each gap
    columns = rr.Scalars.columns(scalars=values[rows][known[rows]].ravel())
    stream.columns(parts, columns, frames=rows, lengths=known[rows] * values.shape[1])


def _threshold(stream: RrdStream, panel: str, limit: float) -> None:
    if not np.isfinite(limit):
        return
    parts = (SERIES, panel, THRESHOLD)
    stream.static(parts, _Pen("bound", GREY, 1.0).line)
    ends = np.array([0, stream.frames - 1])
    stream.columns(parts, rr.Scalars.columns(scalars=[limit, limit]), frames=ends)
