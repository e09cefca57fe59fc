"""A subject's diagnosis as the panel shows it: the kept answer, whether it still holds, who decided what."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

from addb_viewer.jobs.accepted_extension import kept_gain
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.text.diagnosis_vocabulary import title
from addb_viewer.trial_view.trial_verdict import NO_DECISIONS, CauseDecisions, CauseKey
from solver.capture.capture import Subject
from solver.diagnosis.causes.catalogue import cannot_be_accepted
from solver.diagnosis.diagnosis_report import AcceptedGain, DiagnosisReport, Rival
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.fit_result import Fit
from solver.fitting.provenance import extension_in, other_recordings, provenance_of
from solver.fitting.results import extension_log
from solver.fitting.results.extension_log import ACCEPT, REJECT, Decision, Standing, standings

Held = tuple[Decision, Extension] | None  # the extension that was accepted last; None: none is


class InFit(Enum):
    """What the fit on the screen has in its model beside the recorded forces."""

    NO_FIT = "there is no fit"
    NOTHING = "nothing"
    WHAT_HOLDS = "what the last decision accepted"
    AN_OLDER = "what an earlier decision accepted"


@dataclass(frozen=True)
class DiagnosisState:
    """A kept diagnosis; `figures` is None where nobody has asked for one."""

    figures: DiagnosisReport | None = None
    changed: tuple[str, ...] = ()  # recordings that are others than those it was made of
    decision: Decision | None = None  # the last one
    in_fit: InFit = InFit.NO_FIT
    decided: CauseDecisions = NO_DECISIONS  # about its causes
    standings: Mapping[tuple[str, str], Standing] = field(default_factory=dict)  # by id and target of a cause
    gain: AcceptedGain | None = None  # by the accepted causes

    @property
    def acceptable(self) -> bool:
        """Whether a cause is named that can be part of the model, and the recordings are still the same."""
        if self.figures is None or self.changed:
            return False
        return not all(cannot_be_accepted(effect.id) for effect in self.figures.effects)

    @property
    def rejectable(self) -> bool:
        """Whether there is anything to reject."""
        held = self.decision is not None and self.decision.kind == ACCEPT
        return held or (self.figures is not None and bool(self.figures.effects))


def cause_decisions(known: Mapping[CauseKey, Standing], held: Held, extension: str | None) -> CauseDecisions:
    """What people decided; a fit has causes in its model where its extension is the accepted one.

    Args:
        known: what holds about each cause.
        held: the accepted extension, and the decision for it.
        extension: fingerprint that the fit was made with.
    """
    accepted, rejected = (
        frozenset(key for key, standing in known.items() if standing.kind == kind)
        for kind in (ACCEPT, REJECT)
    )
    if held is None or held[1].fingerprint != extension:
        return CauseDecisions(accepted, rejected)
    return CauseDecisions(accepted, rejected, frozenset((c.id, c.target) for c in held[0].causes))


def read_state(subject: Subject, results: Path, fit: Fit | None) -> DiagnosisState:
    """The state of a subject.

    Args:
        subject: whose.
        results: where the answer and the decisions are kept.
        fit: the one on the screen.

    Raises:
        ResultsError: the kept diagnosis or the log of decisions cannot be read.
    """
    made = extension_log.decisions(results)
    decision, known = made[-1] if made else None, standings(made)
    held = None if fit is None else extension_log.accepted(results)
    state = DiagnosisState(
        decision=decision,
        in_fit=_in_fit(held, fit),
        decided=cause_decisions(known, held, None if fit is None else extension_in(fit.provenance)),
        standings=known,
        gain=None if decision is None else kept_gain(decision, results),
    )
    found = kept(results)
    if found is None:
        return state
    figures, made_from = found
    now = provenance_of(subject, [t for t in subject.trials if t.name in figures.trials])
    changed = other_recordings(made_from["provenance"], now)
    return replace(state, figures=figures, changed=tuple(changed))


def _in_fit(held: Held, fit: Fit | None) -> InFit:
    """By the fingerprint that the fit was made with."""
    if fit is None:
        return InFit.NO_FIT
    fingerprint = extension_in(fit.provenance)
    if fingerprint is None:
        return InFit.NOTHING
    same = held is not None and held[1].fingerprint == fingerprint
    return InFit.WHAT_HOLDS if same else InFit.AN_OLDER


def decision_in_words(state: DiagnosisState) -> str:
    """Who decided what and when, and what follows from it; empty where nobody did."""
    decision = state.decision
    if decision is None:
        return ""
    groups: dict[Standing, list[tuple[str, str]]] = {}
    for key, standing in state.standings.items():
        groups.setdefault(standing, []).append(key)
    if not groups:
        groups = {Standing(decision.kind, decision.by, decision.when): []}
    said = [_group_in_words(standing, keys) for standing, keys in groups.items()]
    if decision.left_out:
        said.append(f"Left out, because they lie in the markers alone: {', '.join(decision.left_out)}.")
    said.append(fit_in_words(state))
    if not _same_causes(state):
        said.append("That was about another diagnosis than the present one.")
    return " ".join(said)


def fit_in_words(state: DiagnosisState) -> str:
    """What the last decision means for the fit on the screen; empty where there is none."""
    if state.decision is None:
        return ""
    return (_AFTER_ACCEPT if state.decision.kind == ACCEPT else _AFTER_REJECT)[state.in_fit]


FIT_AGAIN = "fit again."
_AFTER_ACCEPT = {
    InFit.NO_FIT: "The next fit uses it.",
    InFit.NOTHING: f"The fit on the screen does not use it yet: {FIT_AGAIN}",
    InFit.WHAT_HOLDS: "The fit on the screen uses it.",
    InFit.AN_OLDER: f"The fit on the screen still uses what was accepted before: {FIT_AGAIN}",
}
_AFTER_REJECT = {
    InFit.NO_FIT: "The next fit uses the recorded forces alone.",
    InFit.NOTHING: "The fit on the screen uses the recorded forces alone.",
    InFit.WHAT_HOLDS: f"The fit on the screen still uses it: {FIT_AGAIN}",
    InFit.AN_OLDER: f"The fit on the screen still uses what was accepted before: {FIT_AGAIN}",
}


def _group_in_words(standing: Standing, keys: list[tuple[str, str]]) -> str:
    causes = ", ".join(title(Rival(id, target)) for id, target in keys) or "the diagnosis"
    when, did = standing.when.astimezone(), "Accepted" if standing.kind == ACCEPT else "Rejected"
    return f"{did} by {standing.by} on {when:%Y-%m-%d} at {when:%H:%M}: {causes}."


def _same_causes(state: DiagnosisState) -> bool:
    """Whether the last decision is about causes that the kept diagnosis names."""
    if state.figures is None or state.decision is None:
        return True
    named = {(effect.id, effect.target) for effect in state.figures.effects}
    return state.decision.standing.keys() <= named
