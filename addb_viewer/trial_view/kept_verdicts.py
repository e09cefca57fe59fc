"""The verdicts on a subject's trials, read from its folder: kept fit, diagnosis, decisions and review."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import whole_log
from addb_viewer.jobs.stored_solves import stored_solves, waiting_solves
from addb_viewer.trial_view.diagnosis_state import Held, cause_decisions
from addb_viewer.trial_view.forces_in_use import is_changed
from addb_viewer.trial_view.proposals import pending, still_open
from addb_viewer.trial_view.replay import ForceUse
from addb_viewer.trial_view.trial_verdict import CauseKey, TrialVerdict, trial_verdict
from annotations.folding import folded
from annotations.reading import Reading
from annotations.trial_review import TrialReview
from solver.capture.capture import Subject, TrialFiles
from solver.common.errors import ResultsError
from solver.contact.detected_ranges import Proposal
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.fitting.fit_summary import TrialFigures, read_summary
from solver.fitting.results import extension_log
from solver.fitting.results.extension_log import Standing, standings
from solver.fitting.results.kept_trials import KeptTrial, kept_trials
from solver.fitting.results.store import default_folder
from solver.fitting.settings import settings_for

NOTHING_KEPT = KeptTrial((), (), None)


@dataclass(frozen=True)
class KeptResults:
    """What a results folder says of a subject's trials; what cannot be read is as if it were not there."""

    folder: Path
    confidence: float  # from which on a fit leaves a proposal out

    @cached_property
    def figures(self) -> Mapping[str, TrialFigures]:
        """Of each trial in the kept fit; none where there is none.

        Raises:
            ResultsError: they cannot be read.
        """
        try:
            return {trial.name: trial for trial in read_summary(self.folder / "fit.json").trials}
        except FileNotFoundError:
            return {}

    @cached_property
    def report(self) -> DiagnosisReport | None:
        """What the diagnosis says."""
        try:
            found = kept(self.folder)
        except ResultsError:
            return None
        return None if found is None else found[0]

    @cached_property
    def waiting(self) -> tuple[str, ...]:
        """Whose new solves wait to be kept or discarded."""
        return tuple(solve.by for solve in waiting_solves(stored_solves(self.folder)))

    def trial(self, name: str) -> KeptTrial:
        """Mask and proposals of a trial."""
        return self._trials.get(name, NOTHING_KEPT)

    def proposals(self, files: TrialFiles, review: TrialReview | None) -> tuple[Proposal, ...]:
        """Of a trial, but where its own review.json has decided and nobody else."""
        return () if files.has_review and review is None else self.trial(files.name).proposals

    def verdict(self, name: str, review: TrialReview | None, proposals: int) -> TrialVerdict:
        """Where a trial stands.

        Args:
            name: of the trial.
            review: what people decided; None: nobody has.
            proposals: that nobody has decided.
        """
        fit = self.trial(name)
        forces = ForceUse.of(fit.mask, fit.proposals, self.confidence)
        return trial_verdict(
            self.figures.get(name),
            review,
            self.report,
            cause_decisions(self._standings, self._held if fit.extension else None, fit.extension),
            proposals=proposals,
            waiting=self.waiting,
            changed=review is not None and is_changed(fit.feet, forces, review),
        )

    @cached_property
    def _standings(self) -> Mapping[CauseKey, Standing]:
        try:
            return standings(extension_log.decisions(self.folder))
        except ResultsError:
            return {}

    @cached_property
    def _held(self) -> Held:
        return extension_log.accepted(self.folder)

    @cached_property
    def _trials(self) -> Mapping[str, KeptTrial]:
        try:
            return kept_trials(self.folder)
        except ResultsError:
            return {}


def results_of(subject: Subject, folder: Path | None = None) -> KeptResults:
    """What is kept of a subject; nothing is read before it is asked for.

    Args:
        subject: opened.
        folder: of the results; inside the subject's folder by default.
    """
    place = folder or default_folder(subject.folder)
    return KeptResults(place, settings_for(subject.folder).detection.confidence)


def kept_verdicts(subject: Subject, folder: Path | None = None) -> dict[str, TrialVerdict]:
    """Where each trial of a subject stands, by its name; arguments as for `results_of`.

    Raises:
        ReviewError: the review log cannot be read.
        ResultsError: the figures cannot.
    """
    results, log, found = results_of(subject, folder), whole_log(subject.folder), {}
    for files in subject.trials:
        review = review_in(log, files, subject)
        nobody = folded(files.name, (), subject.foot_bodies)
        waiting = pending(results.proposals(files, review), review or nobody, {})
        found[files.name] = results.verdict(files.name, review, still_open(waiting))
    return found


def review_in(log: Reading, files: TrialFiles, subject: Subject) -> TrialReview | None:
    """What people decided about a trial; None where the log knows nothing of it."""
    said = log.about(files.name)
    known = bool(said.edits) or any(row.trial == files.name for row in said.unreadable)
    return folded(files.name, said.edits, subject.foot_bodies, said.unreadable) if known else None
