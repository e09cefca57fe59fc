"""The whole diagnosis of a subject as one readable function."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.subject.opened_subject import ReadTrials, open_subject
from solver.capture.trial import read_trial
from solver.common.errors import FitError
from solver.common.notes import Kind, Note
from solver.common.progress import Progress, part, silent
from solver.contact.detected_ranges import CONTACT_BUT_NO_FORCE, NOT_OVER_FORCE_PLATE
from solver.contact.force_review import ForceReview
from solver.diagnosis.causes.catalogue import ABOUT, catalogue
from solver.diagnosis.causes.effect import Candidate, Estimate, Fitted
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.checks import least_first_gain
from solver.diagnosis.conclusion import conclude
from solver.diagnosis.diagnosis import CLEAN, Detectable
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, report, told_check
from solver.diagnosis.direct_checks.measured import Measured, measure_trials
from solver.diagnosis.direct_checks.pressure_path import turns_by_path
from solver.diagnosis.direct_checks.run_checks import run_checks, suspect_plates
from solver.diagnosis.direct_checks.weight import weighings
from solver.diagnosis.marker_causes import SeenInMarkers, as_distances_tell, with_markers_repaired
from solver.diagnosis.noise.balance_rows import END_S, TrialRows, trial_rows
from solver.diagnosis.scenes import SceneAndPosterior
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import Found, handicap
from solver.diagnosis.search.refinement import refine
from solver.diagnosis.search.selection import Selection, select
from solver.diagnosis.search.terms import Solved, Term
from solver.dynamics.force_prediction.missing_wrench import FEWEST_FRAMES
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.fitting.failing_trials import Failed, together, without_failing
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings, settings_for
from solver.fitting.state import Session
from solver.fitting.summary import all_notes
from solver.kinematics.unseen_bodies import unseen_mass_notes

NINE_IN_TEN = 1.28  # standard deviations by which an estimate falls short at most
GRID = np.geomspace(0.05, 50.0, 200)  # of standard deviations, among which a size to act on is sought
HOP_S = 0.03  # half a window: nothing is lost between them
SURE_STEP = 0.8  # confidence of a proposal that a diagnosis may not pass over in silence
STEPS = (NOT_OVER_FORCE_PLATE, CONTACT_BUT_NO_FORCE)
UNTIL_REVIEWED = "look at it in the video; fits leave it out until somebody reviews it"
FITTED = 0.6  # share of the work that is done once the markers are fitted


def diagnose(
    subject: Subject,
    settings: Settings,
    *,
    trials: Sequence[str] | None = None,
    reviews: Mapping[str, ForceReview] | None = None,
    session: Session | None = None,
    progress: Progress = silent,
) -> DiagnosisReport:
    """Say what is wrong with a subject's recordings, and why.

    Only a person's flags take frames out of the evidence; the detector's proposals are hypotheses here.

    Args:
        subject: as `open_subject` found it.
        settings: of the solve; its table `diagnosis` has noise, model errors and thresholds.
        trials: names of the trials to look at together; None for all.
        reviews: by trial, what people flagged.
        session: as for `solve`, from one diagnosis to the next.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        FitError: no trial has forces.
        SolverError: a file, the model or the data cannot be used.
    """

    def answer(names: Sequence[str]) -> DiagnosisReport:
        looked = part(progress, 0.0, FITTED)
        found = look_at(
            subject, settings, trials=names, reviews=reviews or {}, session=session, progress=looked
        )
        return diagnosis_from(found, part(progress, FITTED, 1.0))

    def answer_without(chosen: Sequence[TrialFiles], *, failed: Failed) -> DiagnosisReport:
        answered = together([files.name for files in chosen], str, answer)
        return replace(answered, notes=(*answered.notes, *ReadTrials([], None, failed).notes))

    return without_failing(subject, trials, answer_without)


@dataclass(frozen=True, eq=False)
class LookedAt:
    """What a diagnosis rests on: the balance, and what is known without it."""

    balance: Balance  # of all trials, markers repaired
    seen: SeenInMarkers
    fit: Fit  # of the repaired markers
    measured: Sequence[Measured]  # for direct checks, who see markers before any repair
    entered_mass_kg: float | None


def look_at(
    subject: Subject,
    settings: Settings,
    *,
    trials: Sequence[str] | None,
    reviews: Mapping[str, ForceReview],
    session: Session | None = None,
    progress: Progress,
) -> LookedAt:
    """All of a diagnosis that comes before its search; arguments and errors as in `diagnose`."""
    balance, seen, fit = repaired_balance(
        subject, settings, trials=trials, reviews=reviews, session=session, progress=progress
    )
    trials_measured = measure_trials(_as_recorded(fit, settings), settings.reading)
    return LookedAt(balance, seen, fit, trials_measured, subject.mass_kg)


def diagnosis_from(found: LookedAt, progress: Progress = silent) -> DiagnosisReport:
    """What is said of all that."""
    direct_checks = run_checks(found.measured, found.entered_mass_kg)
    seen = as_distances_tell(found.seen, direct_checks, found.balance.scenes)
    balance = found.balance.with_checks(
        suspect_plates(direct_checks),
        weighings(found.measured, found.entered_mass_kg),
        turns_by_path(found.measured),
    )
    answer, told = answer_balance(balance, seen, progress), tuple(map(told_check, direct_checks))
    bare = unseen_mass_notes(balance.scenes[0].skeleton, balance.scenes[0].markers.observed_ground)
    notes = *all_notes(found.fit), *bare, *seen.notes, *steps_not_named(balance.scenes, answer.effects)
    return replace(answer, notes=notes, direct_checks=told)


def steps_not_named(scenes: Sequence[Scene], named: Sequence[Cause]) -> Iterator[Note]:
    """Steps off the plates that the detection is sure of, on frames that count, and no cause names."""
    steps = [cause for cause in named if ABOUT[cause.id].seen_standing]
    told = [(foot, *frames) for c in steps for foot in c.target.split("+") for frames in c.frames]
    for scene in scenes:
        for p in scene.proposals:
            start, end = p.range
            is_told = any(t[:2] == (p.foot, scene.name) and t[2] < end and start < t[3] for t in told)
            if is_told or p.reason not in STEPS or p.confidence < SURE_STEP:
                continue
            if scene.counts[start:end].any():
                text = f"detection sees {p.foot} stand on no plate in frames {start} to {end - 1}"
                text += f" ({100 * p.confidence:.0f} % sure), and no cause of this diagnosis names it"
                yield Note(Kind.DETECTED, text, trial=scene.name, advice=UNTIL_REVIEWED)


def answer_balance(balance: Balance, seen: SeenInMarkers, progress: Progress = silent) -> DiagnosisReport:
    """What a balance says: all of a diagnosis that comes after the fit.

    Args:
        balance: of all trials, markers repaired, with what direct checks say of the plates.
        seen: causes that the markers showed before.
        progress: told the fraction done; may raise `Cancelled`.
    """
    balance, selection = causes_of(balance, progress)
    answer = conclude(balance, selection, seen)
    if answer.verdict != CLEAN:
        return answer
    candidates = catalogue(balance.scenes, balance.paths)
    return replace(answer, detectable=find_detectable(balance, selection.null, candidates))


def _as_recorded(fit: Fit, settings: Settings) -> list[Capture]:
    """The fitted trials once more as their files hold them."""
    fitted = {trial.capture.name for trial in fit.trials}
    wanted = [files for files in fit.subject.trials if files.name in fitted]
    return [read_trial(files, settings.reading, fit.subject.mass_kg) for files in wanted]


def causes_of(balance: Balance, progress: Progress = silent) -> tuple[Balance, Selection]:
    """The causes that pay, and the balance that they were found in.

    Sought anew where the right clock leaves frames without a recording, in the balance without these. Clocks
    that are not named there were those frames' doing: they are asked for no more, and give theirs back.
    """
    candidates_of = partial(catalogue, paths=balance.paths)
    selection = select(balance, candidates_of(balance.scenes), progress, candidates_of)
    shifting = [f for f in selection.found if shifts_time(f, balance)]
    while shifting and not selection.ended_early:
        is_recorded = without_unrecorded(balance, shifting)
        if is_recorded is None:
            break
        again = select(is_recorded, candidates_of(is_recorded.scenes), progress, candidates_of)
        named = {f.contender.term.candidate.key for f in again.found}
        still = [f for f in shifting if f.contender.term.candidate.key in named]
        if len(still) == len(shifting):
            return is_recorded, again
        shifting = still
    return balance, selection


def repaired_balance(
    subject: Subject,
    settings: Settings,
    *,
    trials: Sequence[str] | None,
    reviews: Mapping[str, ForceReview],
    session: Session | None = None,
    progress: Progress,
) -> tuple[Balance, SeenInMarkers, Fit]:
    """Fit the markers alone, repair them, and set up the wrench balance.

    Labels are taken as recorded here, so that an exchange is found with its frames, whatever fits correct by
    itself; and a person's own model is scaled, since its size tells of the capture's (`own_model`).

    Arguments and errors as in `diagnose`. The fit that comes along is that of the repaired markers.
    """
    if not any(_may_have_forces(files) for files in subject.trials if trials is None or files.name in trials):
        raise FitError(_no_forces(subject))
    alone = replace(
        settings,
        trajectory=replace(settings.trajectory, enabled=False),
        label_repair=replace(settings.label_repair, enabled=False),
        kinematics=replace(settings.kinematics, keep_scaled_models=False),
    )

    def fitted(repaired: Mapping[str, Capture]) -> Fit:
        return solve(
            subject,
            alone,
            trials=trials,
            reviews=reviews,
            captures=repaired,
            session=session,
            progress=progress,
        )

    fit, scenes, seen = with_markers_repaired(fitted, settings, reviews)
    return balance_of(fit, scenes, settings.diagnosis), seen, fit


def balance_of(fit: Fit, pairs: SceneAndPosterior, diagnosis: DiagnosisSettings) -> Balance:
    """The wrench balance of all trials of a fit that have forces."""
    if not pairs:
        raise FitError(_no_forces(fit.subject))
    seconds = sum(scene.counts.sum() / scene.rate for scene, _ in pairs)
    hop_s = max(HOP_S, 6 * seconds / diagnosis.most_rows)
    each = [trial_rows(scene, posterior, diagnosis, hop_s) for scene, posterior in pairs]
    rows = [trial for trial in each if trial is not None]
    if not rows:
        frames = sum(len(scene.counts) for scene, _ in pairs)
        counted = sum(int(scene.counts.sum()) for scene, _ in pairs)
        raise FitError(
            f"{fit.subject.folder}: {counted} of {frames} frames have markers and the forces of all feet, "
            "and no stretch of them is long enough to judge; nothing can be diagnosed. Frames count where "
            "every loaded foot stands on a plate that was recorded and nobody flagged them: see the notes of "
            "`fit` and `addb-viewer flags`."
        )
    return Balance(rows, diagnosis)


def _may_have_forces(files: TrialFiles) -> bool:
    """Whether there are any, as far as one knows without reading: a TRC file holds markers alone."""
    return files.forces is not None or files.markers.suffix.lower() != ".trc"


def _no_forces(subject: Subject) -> str:
    least = f"at least {FEWEST_FRAMES} frames"
    return f"{subject.folder}: no trial has forces and {least}; nothing can be diagnosed."


def diagnose_subject(folder: Path) -> dict[str, Any]:
    """The diagnosis of a folder with its own settings, in the shape of `diagnose --json`."""
    settings = settings_for(folder)
    return report(diagnose(open_subject(folder), settings)).as_json()


def without_unrecorded(balance: Balance, found: Sequence[Found]) -> Balance | None:
    """The balance without the frames of which nothing was recorded if the named causes are right.

    Forces that are 0.1 s early say nothing of the last 0.1 s. Left as they are, those frames would ask for a
    further cause: a contact at the end of the trial.

    Args:
        balance: of all trials.
        found: causes of it that shift time.

    Returns:
        None where no window is lost, or nothing would be left of a trial. What was evaluated so far counts.
    """
    trials = []
    for trial in balance.trials:
        lost = _unrecorded(trial, found)
        whole = not trial.touched_by(lost).any()
        trials.append(trial if whole else trial.without(_with_the_filters_ends(lost, trial, balance)))
    if all(one is other for one, other in zip(trials, balance.trials, strict=True)):
        return None
    if not all(t.windows.count for t in trials):
        return None
    is_recorded = Balance(trials, balance.settings).with_checks(
        balance.suspect, balance.weighings, balance.paths
    )
    is_recorded.evaluations = balance.evaluations
    return is_recorded


def shifts_time(found: Found, balance: Balance) -> bool:
    """Whether a cause reads the recording at other times, some of which lie outside it."""
    term = found.contender.term
    return any(term.candidate.unrecorded(scene, term.eta).any() for scene in balance.scenes)


def _unrecorded(trial: TrialRows, found: Sequence[Found]) -> Bool[np.ndarray, " frames"]:
    lost = np.zeros(trial.scene.frames, dtype=bool)
    for one in found:
        term = one.contender.term
        lost |= term.candidate.unrecorded(trial.scene, term.eta)
    return lost


def _with_the_filters_ends(
    lost: Bool[np.ndarray, " frames"], trial: TrialRows, balance: Balance
) -> Bool[np.ndarray, " frames"]:
    """Frames beside them as well: what is read there lies at the recording's end."""
    reach = round(END_S * trial.scene.rate)
    return np.convolve(lost, np.ones(2 * reach + 1), mode="same") > 0


def find_detectable(
    balance: Balance, null: Solved, candidates: Sequence[Candidate]
) -> tuple[Detectable, ...]:
    """Sizes for each parameter of the most usual causes.

    Args:
        balance: of all trials.
        null: its fit without any cause.
        candidates: the catalogue; others than those asked are left out.
    """
    found = []
    for candidate in candidates:
        if candidate.about.asked_up_to is None:
            continue
        least_eta = min(candidate.starts(balance.scenes), key=lambda eta: float(np.square(eta).sum()))
        term = balance.term(candidate, least_eta)
        if term is None:
            continue
        solved = balance.solve_at([refine(balance, term, [], null.noise_scale)], null.noise_scale)
        needed = least_first_gain(candidate, null.noise_scale.scale, balance.settings)
        needed += handicap(candidate, balance.settings)
        cost = float(np.log(np.diag(solved.root)).sum())  # ½ log det M
        prior = _estimates_at_nothing(candidate, balance, solved.terms[0], solved.terms[0].prior_std)
        for name, estimate in solved.estimates(0, balance.scenes).items():
            p, left = prior[name].std, estimate.std
            if not 0 < left < p:
                continue
            alone = (left**-2 - p**-2) ** -0.5
            by_evidence = alone * np.sqrt(2 * max(0.0, needed + cost) * (1 + (alone / p) ** 2))
            to_act_on = _to_act_on(candidate, balance, solved.terms[0], name, alone)
            size = max(float(by_evidence), to_act_on) + NINE_IN_TEN * alone
            if np.isfinite(size):
                found.append(Detectable(candidate.id, candidate.target, name, size))
    return tuple(found)


def _estimates_at_nothing(
    candidate: Candidate, balance: Balance, term: Term, std: Float[np.ndarray, " parameters"]
) -> dict[str, Estimate]:
    """The catalogue's parameters where there is nothing, with given standard deviations of x and η."""
    linear = len(std) - len(term.tangent_mean)
    x, covariance = np.zeros(linear), np.diag(std[:linear] ** 2)
    no_eta = tuple(0.0 for _ in term.eta)
    return candidate.estimates(balance.scenes, Fitted(no_eta, tuple(std[linear:].tolist()), x, covariance))


def _to_act_on(candidate: Candidate, balance: Balance, term: Term, name: str, std: float) -> float:
    """The least size of one parameter, all others at nothing, that anybody would act on."""
    nothing = _estimates_at_nothing(candidate, balance, term, np.zeros(len(term.prior_std)))
    for size in GRID * std:
        larger = replace(nothing[name], value=nothing[name].value + size)
        if candidate.is_notable({**nothing, name: larger}):
            return float(size)
    return float("inf")
