"""Figures of a fit, made by hand."""

from dataclasses import fields, replace

from solver.dynamics.thresholds import verdicts
from solver.fitting.fit_summary import (
    FitSummary,
    ForceFigures,
    HeldOutFigures,
    LayoutFigures,
    LayoutsFigures,
    MissedFigures,
    ModelFigures,
    MomentFigures,
    PersonFigures,
    TrialFigures,
)


def force(rms_N, rms_BW=None):
    return ForceFigures(rms_N, rms_N, rms_BW)


def moment(rms_Nm, rms_BWh=None):
    return MomentFigures(rms_Nm, rms_Nm, rms_BWh)


def of_trial(**known):
    """What is not given is None, or there is none of it."""
    empty = ("ranges", "faults", "stored")
    values = {f.name: () if f.name.endswith(empty) else None for f in fields(TrialFigures)}
    values |= {"name": "walk", "frames": 100, "frames_with_force_used": 100, "mask_source": "review"}
    values |= {"rate_hz": 100.0, "forces_predicted": False, "seconds": {}, "coordinates_guessed_ranges": {}}
    values |= {"torque_std_Nm": {}}
    made = TrialFigures(**values | known)
    judged = verdicts(made.force_BW, made.moment_BWh, made.marker_rms_m, made.marker_max_m)
    return replace(made, hicks=judged)


def of_subject(*trials, mass_kg=70.0, files=()):
    return FitSummary(PersonFigures(mass_kg, None, 1.75), ModelFigures(22, 37), trials, files, (), ())


def first_layout(rms_N, rms_Nm, markers_N, markers_Nm):
    own, markers = (force(rms_N), moment(rms_Nm)), (force(markers_N), moment(markers_Nm))
    return HeldOutFigures(22, (), (6.0, 8.0), *own, *own, *markers)


def of_layouts(ratio, interval):
    """In blocks alone, the force is missed by this ratio to the markers alone."""
    missed = MissedFigures(20.0 * ratio, 20.0, (4.0, 6.0), ratio, interval)
    blocks = LayoutFigures(6, 19, 107, missed, MissedFigures(9.0, 10.0, (6.0, 6.0), 0.9, (0.8, 1.1)))
    return LayoutsFigures(blocks, None)
