"""A diagnosis as it is told: one typed answer for words, pictures and JSON; and what accepting it changes.

`diagnosis.json` and `diagnose --json` hold a `DiagnosisReport`; `read_report` makes one of them again.
Frames are 0-based, the end excluded, at the markers' rate. JSON has no NaN: what nobody knows is None.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from solver.common.notes import Note
from solver.common.typed_json import from_plain, plain
from solver.diagnosis.cause_decisions import CauseDecisions, Chances
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.checks import Decision
from solver.diagnosis.diagnosis import AfterTrial, Detectable, Gain, Remaining, ToBeSure
from solver.diagnosis.direct_checks.statement import STATED_NATS, Statement
from solver.diagnosis.extended_fit import ExtendedGain
from solver.diagnosis.residual_description import Residual, ResidualOverTime, TrialResidual
from solver.dynamics.trajectory import extension
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.fitting.results.extension_log import plain_causes
from solver.kinematics.label_faults.fault import Exchange

VERSION = 1  # of what a report holds; raised when an old reader would misread it
MOST_CHANGED = 5  # joint torques that are listed
MOST_REFUSED = 5  # causes whose decisions are told though they are not named
NATS_DIGITS = 2  # evidence is no better known
TIME_HISTORY_DIGITS = 2  # [s, N, N·m] what is only drawn

Frames = tuple[str, int, int]  # trial, first frame, the one after the last


@dataclass(frozen=True)
class Figure:
    """A parameter of a cause, in the unit that its name carries."""

    value: float | None
    std: float | None = None


@dataclass(frozen=True)
class ForceOverTime:
    """Force on the person, ground frame [N], at every `step`-th frame from `start` on."""

    trial: str
    start: int
    step: int
    force_N: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Cause:
    """Something that was found: a name, or where to look."""

    id: str
    target: str
    parameters: Mapping[str, Figure]
    confidence: float
    frames: tuple[Frames, ...]
    sentence: str = ""
    remedy: str = ""
    at_fault: str = ""  # recording, model or movement
    in_its_class: float | None = None  # confidence, and that of names of the same trace
    outside_the_list: float | None = None  # how likely it is something that is on no list
    told_as: Literal["name", "tentative"] = "name"  # tentative: less likely than all else together
    trial: str | None = None  # None: several
    time_histories: tuple[ForceOverTime, ...] = ()

    @property
    def is_tentative(self) -> bool:
        """Whether it is no name, only where to look."""
        return self.told_as == "tentative"


@dataclass(frozen=True)
class Rival:
    """What might be in a cause's place."""

    id: str
    target: str
    instead_of: str | None = None  # "id target" of the named one
    why: str = ""
    separate_by: str = ""
    confidence: float | None = None


@dataclass(frozen=True)
class Decided:
    """All that was asked of one cause."""

    id: str
    target: str
    named: bool
    odds_nats: float | None
    checks: tuple[Decision, ...]


@dataclass(frozen=True)
class DirectCheck:
    """What the files say without a model of the body."""

    direct_check: str
    sentence: str
    nats: Mapping[str, float]  # by class of faults
    speaks_for: tuple[str, ...] = ()
    trial: str | None = None
    target: str | None = None
    figures: Mapping[str, float] = field(default_factory=dict)
    against: tuple[str, ...] = ()


@dataclass(frozen=True)
class DiagnosisReport:
    """What is wrong: verdict, causes, rivals, gain and remainder."""

    verdict: str
    effects: tuple[Cause, ...]
    alternatives: tuple[Rival, ...]
    gain: Mapping[str, Gain]
    remaining: Remaining
    trials: tuple[str, ...]
    version: int = VERSION
    at_fault: tuple[str, ...] = ()
    chances: Chances | None = None
    rates_Hz: Mapping[str, float] = field(default_factory=dict)
    starts_s: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    evidence_nats: float | None = None
    certain_nats: float = DiagnosisSettings.certain_gain
    ended_early: bool = False
    detectable: tuple[Detectable, ...] = ()
    decisions: tuple[Decided, ...] = ()
    residual: Residual | None = None
    direct_checks: tuple[DirectCheck, ...] = ()
    to_be_sure: ToBeSure | None = None
    after_trial: AfterTrial | None = None  # where an earlier diagnosis of fewer trials was not sure
    scale_factor: float | None = None  # a scale's reading over the entered mass; None: no scale

    def as_json(self) -> dict[str, Any]:
        """Plain values, as `diagnose --json` has them."""
        return plain(self)


@dataclass(frozen=True)
class AcceptedCause:
    """As the trajectory fit found it."""

    id: str
    target: str
    parameters: Mapping[str, Figure]


@dataclass(frozen=True)
class AcceptedExchange:
    """Labels that are exchanged back."""

    trial: str
    labels: tuple[str, ...]
    frames: tuple[int, int]


@dataclass(frozen=True)
class TorqueChanges:
    """RMS by dof [N·m, or N for translations]."""

    rms: Mapping[str, float]  # of the change
    before_rms: Mapping[str, float]  # of the torque itself
    most_changed: tuple[str, ...]


@dataclass(frozen=True)
class AcceptedGain:
    """What accepting causes changes, `accept --json`; of exchanged labels alone there are no figures."""

    causes: tuple[AcceptedCause, ...]
    exchanges: tuple[AcceptedExchange, ...]
    held_out_linear_residual_N: Gain | None = None  # None: no block is held out
    held_out_angular_residual_Nm: Gain | None = None
    held_out_linear_drop_N: tuple[float, float] | None = None  # None: too few blocks to tell
    held_out_angular_drop_Nm: tuple[float, float] | None = None
    marker_rms_m: Gain | None = None
    mass_kg: Gain | None = None
    held_out_frames: int = 0
    held_out_blocks: int = 0
    joint_torque_change: TorqueChanges | None = None
    notes: tuple[Note, ...] = ()


def read_report(stored: Mapping[str, Any]) -> DiagnosisReport:
    """The report of its plain values.

    Raises:
        ValueError: these are none, or of another version.
    """
    if stored.get("version") != VERSION:
        raise ValueError(f"format {stored.get('version')}, this version reads {VERSION}")
    return from_plain(stored, DiagnosisReport)


def report(found: DiagnosisReport, why: str | None = None) -> DiagnosisReport:
    """What is told of all that was found.

    Args:
        found: by a diagnosis.
        why: id of a cause whose decisions are told in any case.
    """
    refused = [c for c in found.decisions if not c.named][:MOST_REFUSED]
    told = tuple(c for c in found.decisions if c.named or c.id == why or c in refused)
    residual = None if found.residual is None else _shortened(found.residual)
    return replace(found, decisions=told, residual=residual)


def accepted_gain(
    gain: ExtendedGain, causes: Sequence[extension.Cause], exchanges: Sequence[Exchange]
) -> AcceptedGain:
    """What accepting causes changes, as it is told.

    Args:
        gain: of the trajectory fit with them.
        causes: as that fit found them.
        exchanges: of labels, accepted with them.
    """
    translations = {c.name for c in gain.fit.skeleton.free_coordinates if c.motion == "translation"}
    most = [dof for dof in gain.joint_torque_change if dof not in translations][:MOST_CHANGED]
    return AcceptedGain(
        causes=told_causes(causes),
        exchanges=told_exchanges(exchanges),
        held_out_linear_residual_N=_known(gain.held_out_linear_residual_N),
        held_out_angular_residual_Nm=_known(gain.held_out_angular_residual_Nm),
        held_out_linear_drop_N=gain.held_out_linear_drop_N,
        held_out_angular_drop_Nm=gain.held_out_angular_drop_Nm,
        marker_rms_m=_known(gain.marker_rms_m),
        mass_kg=_known(gain.mass_kg),
        held_out_frames=gain.held_out_frames,
        held_out_blocks=gain.held_out_blocks,
        joint_torque_change=TorqueChanges(gain.joint_torque_change, gain.joint_torque_rms, tuple(most)),
        notes=gain.notes,
    )


def told_causes(causes: Sequence[extension.Cause]) -> tuple[AcceptedCause, ...]:
    """As they are told; what the recording says nothing about is None."""
    return tuple(from_plain(cause, AcceptedCause) for cause in plain_causes(causes))


def told_exchanges(exchanges: Sequence[Exchange]) -> tuple[AcceptedExchange, ...]:
    """Of labels, as they are told."""
    return tuple(AcceptedExchange(e.trial, e.labels, (e.start, e.end)) for e in exchanges)


def _known(gain: Gain) -> Gain | None:
    return gain if math.isfinite(gain.before) else None


def cause_of(
    about: About, target: str, parameters: Mapping[str, Estimate], confidence: float, ranges: Sequence[Range]
) -> Cause:
    """A cause that was found, as it is told.

    Args:
        about: what it is.
        target: of it.
        parameters: as estimated.
        confidence: in its name.
        ranges: where it acts.
    """
    trials = sorted({r.trial for r in ranges})
    return Cause(
        id=about.id,
        target=target,
        parameters={name: Figure(finite(e.value), finite(e.std)) for name, e in parameters.items()},
        confidence=confidence,
        frames=tuple((r.trial, r.start, r.end) for r in ranges),
        sentence=about.sentence.format(target=target),
        remedy=about.remedy.format(target=target),
        at_fault=about.at_fault.value,
        trial=trials[0] if len(trials) == 1 else None,
    )


def told_decisions(decisions: Sequence[CauseDecisions]) -> tuple[Decided, ...]:
    """All that was asked of causes, as it is told."""
    return tuple(
        Decided(
            cause.id,
            cause.target,
            cause.named,
            finite(cause.odds_nats),
            tuple(replace(d, nats=finite(d.nats), limit=finite(d.limit)) for d in cause.decisions),
        )
        for cause in decisions
    )


def told_check(statement: Statement) -> DirectCheck:
    """What a direct check says, as it is told."""
    return DirectCheck(
        direct_check=statement.direct_check,
        sentence=statement.sentence,
        nats={str(about): round(nats, NATS_DIGITS) for about, nats in statement.nats.items()},
        speaks_for=tuple(map(str, statement.spoken_for(STATED_NATS))),
        trial=statement.trial,
        target=statement.target,
        figures=statement.figures,
        against=statement.against,
    )


def _shortened(residual: Residual) -> Residual:
    """With no more digits over time than are drawn."""
    return replace(residual, trials=tuple(map(_in_trial, residual.trials)))


def _in_trial(trial: TrialResidual) -> TrialResidual:
    over_time = {
        name: tuple(np.round(values, TIME_HISTORY_DIGITS).tolist())
        for name, values in vars(trial.time_history).items()
    }
    return replace(trial, time_history=ResidualOverTime(**over_time))


def finite(value: float | None) -> float | None:
    """None for what the recording says nothing about."""
    return value if value is not None and math.isfinite(value) else None
