"""What a report of one subject is made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property

from addb_viewer.report.frames_kept import Kept, kept_frames
from addb_viewer.trial_view.proposals import pending, still_open
from addb_viewer.trial_view.recorded_subject import Recording
from addb_viewer.trial_view.trial_verdict import NO_DECISIONS, CauseDecisions, TrialVerdict, trial_verdict
from annotations.folding import folded
from solver.diagnosis.diagnosis_report import AcceptedGain, DiagnosisReport
from solver.fitting.fit_result import StanceInfluence
from solver.fitting.results.extension_log import Standing


@dataclass(frozen=True)
class DiagnosisShown:
    """A diagnosis that belongs to the fit, or why none is shown."""

    figures: DiagnosisReport | None = None
    absent: str = "Nobody has asked for a diagnosis: `addb-viewer report SUBJECT --diagnose` makes one."
    decision: str = ""  # who accepted or rejected it
    standings: Mapping[tuple[str, str], Standing] = field(default_factory=dict)  # by id and target of a cause
    gain: AcceptedGain | None = None
    decided: CauseDecisions = NO_DECISIONS  # about its causes


@dataclass(frozen=True)
class SubjectReport:
    """A subject's fit and what is told beside it."""

    recording: Recording
    diagnosis: DiagnosisShown = field(default_factory=DiagnosisShown)
    influences: tuple[StanceInfluence, ...] = ()  # none are asked of long recordings
    made: datetime = field(default_factory=lambda: datetime.now().astimezone())

    @cached_property
    def kept(self) -> tuple[Kept, ...]:
        """The frames of each trial."""
        return tuple(kept_frames(record.replay) for record in self.recording.trials)

    @cached_property
    def verdicts(self) -> tuple[TrialVerdict, ...]:
        """Where each trial stands."""
        found, shown, feet = [], self.diagnosis, self.recording.fit.subject.foot_bodies
        for record in self.recording.trials:
            name = record.replay.name
            review = folded(name, [edit for edit in self.recording.edits if edit.trial == name], feet)
            waiting = still_open(pending(record.replay.forces.proposals, review, {}))
            found.append(
                trial_verdict(record.figures, review, shown.figures, shown.decided, proposals=waiting)
            )
        return tuple(found)
