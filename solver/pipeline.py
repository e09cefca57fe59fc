"""The whole solve as one readable function: subject folder in, fit out."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.conditioning import ConditionedPlate, condition
from solver.capture.trial import read_static, read_trial
from solver.contact.assignment import assign
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.mass import mass_from_forces
from solver.errors import FitError
from solver.fit import Fit, TrialFit
from solver.kinematics.calibration import Calibration, calibrate, choose_frames
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.marker_matching import MarkerMatch, match_markers
from solver.kinematics.motion import Motion
from solver.kinematics.scale_prior import stature
from solver.progress import Progress, part, silent
from solver.provenance import provenance_of
from solver.settings import Settings, as_dict
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.osim import load_skeleton
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

SCALING_SHARE = 0.3  # of the progress bar; the trials share the rest


def solve(
    subject: Subject,
    settings: Settings,
    *,
    trials: Sequence[str] | None = None,
    progress: Progress = silent,
) -> Fit:
    """Scale the model to the subject, fit every trial's motion, and compute its dynamics.

    Args:
        subject: as `open_subject` found it.
        settings: of every stage.
        trials: names of the trials to solve; None for all.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        SolverError: a file, the model or the data cannot be used; the message says which and what to do.
    """
    clock = _Clock()
    chosen = _chosen(subject, trials)
    generic = _generic(subject)
    with clock("load"):
        captures = [_read(files, progress) for files in chosen]
        static = read_static(subject.static) if subject.static else None
    recordings = [c.markers for c in captures]
    match = match_markers(generic, recordings + ([static.markers] if static else []))
    with clock("scaling"):
        calibration = _calibrated(subject, settings, generic, match, captures, static, part(progress, 0, 0.3))
    skeleton = calibration.skeleton
    share = (1 - SCALING_SHARE) / len(captures)
    fits = []
    for i, capture in enumerate(captures):
        start = SCALING_SHARE + i * share
        fits.append(_moved(capture, match, skeleton, settings, part(progress, start, start + 0.8 * share)))
    contacts = [_contacts(fit, skeleton, subject, settings) for fit in fits]
    mass_kg, mass_note = _mass(subject, skeleton, fits, contacts)
    skeleton = with_mass(skeleton, mass_kg)
    solved = []
    for i, (fit, contact) in enumerate(zip(fits, contacts, strict=True)):
        solved.append(_with_dynamics(fit, contact, skeleton, settings))
        progress("inverse dynamics", SCALING_SHARE + (i + 1) * share)
    height = subject.height_m or stature(skeleton)
    notes = [*subject.notes, *generic.notes, *match.notes, *calibration.notes, mass_note]
    if subject.height_m is None and height is not None:
        notes.append(f"height not given; the scaled model stands {height:.2f} m tall")
    seconds = clock.seconds
    return Fit(
        subject=subject,
        skeleton=skeleton,
        trials=tuple(
            replace(fit, seconds=fit.seconds | {"load": seconds["load"] / len(solved), "scaling": seconds["scaling"]})
            for fit in solved
        ),
        mass_kg=mass_kg,
        height_m=height if height is not None else float("nan"),
        settings=as_dict(settings),
        provenance=provenance_of(subject, chosen),
        notes=tuple(n for n in notes if n),
    )
