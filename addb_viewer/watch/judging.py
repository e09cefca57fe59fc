"""What is found out about one trial, in processes of its own: first look, fit, diagnosis.

Nothing of it takes the place of a kept fit. The diagnosis is kept beside the log of verdicts.
"""

import contextlib
import multiprocessing
import os
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from addb_viewer.jobs.solving import job_for
from addb_viewer.jobs.suggested_activities import suggestions_of
from solver.capture.atomic import made_folder
from solver.capture.capture import Capture, Markers, TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import ReadingSettings, read_trial
from solver.common.errors import SolverError
from solver.common.gravity import GRAVITY
from solver.common.operating_system import ignore_ctrl_c
from solver.common.plate_figures import CONTACT_N
from solver.common.true_runs import runs
from solver.diagnosis.diagnose_subject import diagnose
from solver.diagnosis.diagnosis_report import DiagnosisReport, report
from solver.diagnosis.direct_checks.measured import Measured, measure_trials
from solver.diagnosis.direct_checks.run_checks import run_checks
from solver.diagnosis.direct_checks.statement import Statement
from solver.export.gait_tables import trial_gait
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.fit_summary import TrialFigures
from solver.fitting.pipeline import solve
from solver.fitting.results.store import write_json
from solver.fitting.settings import settings_for
from solver.fitting.state import KeptModel, Session
from solver.fitting.summary import summary
from solver.gait.gait_events import Source, Stance, side_of
from solver.skeleton.forward import body_poses

LOST_S = 0.3  # a marker that is out of sight for less is bridged by its neighbours
SEEN_SHARE = 0.25  # of the frames: what is seen less is no marker of the person
OFF_ZERO_N = 20.0  # a plate that reads more while it is empty was not tared well
MISSING_SHARE = 0.5  # of the person's weight: where plates lack so much, a foot is beside them
MISSING_S = 0.15  # and for so long: a step lasts longer
MEASURED_SHARE = 0.2  # of a stance under load on a plate: with less, the step missed the plates
NEAR_PLATE_M = 0.35  # from a plate's edge: a foot that is farther off missed all plates
FORMER = 3  # trials of the session that a new one is held against


@dataclass(frozen=True)
class Step:
    """One foot on the ground."""

    number: int  # in order of time, from 1
    side: str  # Left, Right
    whole: bool  # on a plate, from its contact to its end
    missed: bool  # between others that plates measured, this one they did not
    plate: int | None  # the nearest plate, from 1; None: none is near
    frames: tuple[int, int]


@dataclass(frozen=True)
class Look:
    """What a recording shows by itself."""

    lost: tuple[tuple[str, float], ...]  # markers, and for how long [s], the longest first
    off_zero: tuple[tuple[int, float], ...]  # plates from 1, and what they read vertically while empty [N]
    has_plates: bool
    is_loaded: bool  # a plate carries something at some time
    apart_s: float = 0.0  # what the forces begin or end earlier or later than the markers [s]


@dataclass(frozen=True)
class FirstLook:
    """Before any fit."""

    look: Look
    statements: tuple[Statement, ...]  # direct checks on this trial
    unborne_s: tuple[float, ...]  # times amid the trial at which plates lack the person's weight [s]


@dataclass(frozen=True)
class FitLook:
    """After the fit."""

    look: Look
    figures: TrialFigures
    steps: tuple[Step, ...]
    activity: str
    model: KeptModel | None = None  # the person's, for the next trial


@dataclass(frozen=True)
class DiagnosisLook:
    """After the diagnosis."""

    report: DiagnosisReport
    model: KeptModel | None  # the person's, for the next diagnosis


def begin_worker() -> None:
    """A process that judges: Ctrl-C is its parent's affair, and it ends with that, however that ends."""
    ignore_ctrl_c()
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(0)


def warm_up() -> None:
    """Load all that judging needs, before the first trial comes."""


def first_look(folder: Path, name: str, former: Sequence[str]) -> FirstLook:
    """What the files say by themselves, held against former trials of the session.

    Args:
        folder: of the subject.
        name: of the trial.
        former: names of trials before it, the last ones last.

    Raises:
        SolverError: it cannot be read.
    """
    subject, reading = open_subject(folder, awaits=True), settings_for(folder).reading
    files = {one.name: one for one in subject.trials}
    names = [*(one for one in former[-FORMER:] if one in files and one != name), name]
    captures = []
    for one in names:
        try:
            captures.append(_capture(files[one], _changed(files[one]), subject.mass_kg, reading))
        except SolverError:  # a former one condemns itself alone
            if one == name:
                raise
    said = run_checks(measure_trials(captures, reading), subject.mass_kg)
    own = tuple(one for one in said if one.trial in (name, None))
    measured = Measured(captures[-1], reading)
    return FirstLook(_look(captures[-1]), own, tuple(_unborne_s(measured, subject.mass_kg)))


def fit_look(folder: Path, name: str, model: KeptModel | None = None) -> FitLook:
    """The fit of one trial; held-out forces are not predicted, and nothing is kept on disk.

    Args:
        folder: of the subject.
        name: of the trial.
        model: the person's, as the trial before left it.

    Raises:
        SolverError: it cannot be fitted.
    """
    session = Session(model)
    job = job_for(folder, trials=[name], without_extension=True, awaits=True)
    fit = solve(
        job.subject, job.settings, trials=job.trials, reviews=job.reviews, held_out=False, session=session
    )
    trial, figures = fit.trials[0], summary(fit).trials[0]
    activities = suggestions_of(trial, fit.skeleton)
    longest = max(activities, key=lambda one: one.end - one.start, default=None)
    return FitLook(
        _look(trial.capture),
        figures,
        tuple(_steps(fit, trial)),
        longest.activity if longest else "",
        session.next,
    )


def diagnosis_of(folder: Path, name: str, place: Path, model: KeptModel | None = None) -> DiagnosisLook:
    """The diagnosis of one trial, which is kept in a folder for whoever wants to read all of it.

    Args:
        folder: of the subject.
        name: of the trial.
        place: where it is kept.
        model: the person's, as the diagnosis before left it: that has markers repaired by itself.

    Raises:
        SolverError: there is nothing to diagnose.
    """
    session = Session(model)
    job = job_for(folder, trials=[name], without_extension=True, awaits=True)
    said = diagnose(job.subject, job.settings, trials=job.trials, reviews=job.reviews, session=session)
    found = report(said)
    with contextlib.suppress(SolverError):  # the verdict does not rest on it
        write_json(made_folder(place) / f"{name}.json", found.as_json())
    return DiagnosisLook(found, session.next)


Changed = tuple[tuple[int, int], ...]  # size [bytes] and time of the last change [ns] of each file


@lru_cache(maxsize=2 * FORMER)
def _capture(files: TrialFiles, _: Changed, mass_kg: float | None, reading: ReadingSettings) -> Capture:
    return read_trial(files, reading, mass_kg)


def _changed(files: TrialFiles) -> Changed:
    stats = [path.stat() for path in (files.markers, files.forces) if path is not None]
    return tuple((stat.st_size, stat.st_mtime_ns) for stat in stats)


def _look(capture: Capture) -> Look:
    plates = capture.plates
    off = ((k, float(p.zero_ground[1])) for k, p in enumerate(plates, 1) if p.zero_ground is not None)
    return Look(
        tuple(sorted(_lost(capture.markers), key=lambda one: -one[1])),
        tuple((k, level) for k, level in off if abs(level) >= OFF_ZERO_N),
        bool(plates),
        any(bool((np.nan_to_num(plate.force_ground[:, 1]) > CONTACT_N).any()) for plate in plates),
        _apart_s(capture),
    )


def _apart_s(capture: Capture) -> float:
    ends = capture.markers.times[[0, -1]]
    return max((float(np.abs(plate.times[[0, -1]] - ends).max()) for plate in capture.plates), default=0.0)


def _lost(markers: Markers) -> Iterator[tuple[str, float]]:
    """Markers that were out of sight while most others were seen, and for how long at a time [s]."""
    seen = np.isfinite(markers.positions_ground).all(axis=2)
    own = np.flatnonzero(seen.mean(axis=0) >= SEEN_SHARE) if len(seen) else ()
    if not len(own):
        return
    in_view = seen[:, own].mean(axis=1) > 0.5  # of the others: the person is there
    for column in own:
        longest = max((end - start for start, end in runs(in_view & ~seen[:, column])), default=0)
        if longest / markers.rate >= LOST_S:
            yield markers.names[column], longest / markers.rate


def _unborne_s(trial: Measured, entered_kg: float | None) -> Iterator[float]:
    """Middles of stretches between loads on which plates lack most of what the motion asks for [s]."""
    mass_kg = entered_kg or trial.usual_kg
    total = trial.total_N
    with np.errstate(invalid="ignore"):
        loaded = np.flatnonzero(total > CONTACT_N)
        if mass_kg is None or not len(loaded):
            return
        lacking = mass_kg * (GRAVITY + trial.acceleration) - total > MISSING_SHARE * mass_kg * GRAVITY
    for start, end in runs(lacking):
        if loaded[0] < start and end <= loaded[-1] and (end - start) / trial.rate >= MISSING_S:
            yield float(trial.capture.markers.times[(start + end) // 2])


def _steps(fit: Fit, trial: TrialFit) -> Iterator[Step]:
    gait = trial_gait(fit, trial)
    if gait is None or trial.contacts is None or not trial.contacts.has_plates:
        return
    times, contacts = trial.motion.times, trial.contacts
    spans = [_frames(stance, times) for stance in gait.stances]
    under_load = [
        float(contacts.in_contact[slice(*span), one.foot].mean()) if span[1] > span[0] else 0.0
        for one, span in zip(gait.stances, spans, strict=True)
    ]
    measured = [k for k, share in enumerate(under_load) if share >= MEASURED_SHARE]
    for k, (one, span) in enumerate(zip(gait.stances, spans, strict=True)):
        is_measured = under_load[k] >= MEASURED_SHARE
        amid = bool(measured) and measured[0] < k < measured[-1]
        whole = one.source is Source.FORCE and None not in (one.contact_s, one.off_s) and is_measured
        side = side_of(gait.feet[one.foot])
        yield Step(k + 1, side, whole, amid and not is_measured, _plate_under(fit, trial, one, span), span)


def _frames(stance: Stance, times: np.ndarray) -> tuple[int, int]:
    start = times[0] if stance.contact_s is None else stance.contact_s
    end = times[-1] if stance.off_s is None else stance.off_s
    first, last = np.searchsorted(times, [start, end])
    return int(first), int(last)


def _plate_under(fit: Fit, trial: TrialFit, stance: Stance, span: tuple[int, int]) -> int | None:
    """The plate, or what was pressed of it, that is nearest to the foot; None: none is near."""
    foot = fit.skeleton.body_index(trial.contacts.foot_bodies[stance.foot])  # type: ignore[union-attr]
    place = body_poses(fit.skeleton, trial.motion.q[slice(*span)])[1][:, foot]
    if not len(place):
        return None
    where, near = np.nanmedian(place, axis=0)[[0, 2]], {}
    for k, plate in enumerate(trial.capture.plates, start=1):
        outline = plate.corners_ground if plate.corners_ground is not None else plate.cop_ground
        known = outline[np.isfinite(outline).all(axis=1)][:, [0, 2]]
        if len(known):
            low, high = known.min(axis=0), known.max(axis=0)
            near[k] = float(np.linalg.norm(where - where.clip(low, high)))
    nearest = min(near, key=lambda k: near[k], default=None)
    return nearest if nearest is not None and near[nearest] <= NEAR_PLATE_M else None
