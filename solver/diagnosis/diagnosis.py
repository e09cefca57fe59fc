"""What a diagnosis says."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from solver.common.notes import Note
from solver.diagnosis.cause_decisions import CauseDecisions, Chances
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.direct_checks.statement import Statement
from solver.diagnosis.force_histories import ForceHistory
from solver.diagnosis.residual_description import Residual
from solver.fitting.diagnosis_settings import DiagnosisSettings

EXPLAINED, CLEAN, UNEXPLAINED = "explained", "clean", "unexplained"


@dataclass(frozen=True)
class NamedEffect:
    """A cause that was found."""

    id: str
    target: str
    parameters: dict[str, Estimate]
    confidence: float
    frames: tuple[Range, ...]
    sentence: str
    remedy: str
    time_histories: tuple[ForceHistory, ...] = ()  # of a force that acts for a while
    outside_the_list: float = float("nan")  # how likely it is something that is on no list; nan: not asked
    in_its_class: float = float("nan")  # confidence, and that of names of the same trace; nan: not asked
    is_tentative: bool = False  # less likely than all else together: no name, but where to look


@dataclass(frozen=True)
class Alternative:
    """What might be in its place."""

    id: str
    target: str
    instead_of: str  # "id target" of the named one
    why: str
    separate_by: str
    confidence: float = float("nan")  # as of the named one; nan where nobody knows


@dataclass(frozen=True)
class Gain:
    """A figure before and after, with an interval of the latter [N, N·m or m]."""

    before: float
    after: float
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class Location:
    """Where something acts that nothing explains."""

    body: str
    rms_force_N: float
    mean_force_N: tuple[float, float, float]
    depends_on: str


@dataclass(frozen=True)
class Unlisted:
    """What is likelier than every name of the catalogue, told as what it touches."""

    touches: str  # body, event, plate or time
    target: str  # the plate or the trial; empty for the body
    trial: str | None  # None: in all
    sentence: str
    frames: tuple[tuple[str, int, int], ...]  # trial, first frame, the one after the last
    rms_force_N: float
    gain_nats: float  # of log evidence with prior odds, beyond what is named


@dataclass(frozen=True)
class Detectable:
    """A parameter of a cause, and how far from nothing it would have been found nine times in ten."""

    id: str
    target: str
    parameter: str
    size: float  # in the parameter's unit


@dataclass(frozen=True)
class ToBeSure:
    """The short trial that would tell a name from what may be in its place; none of the list: no trial."""

    id: str
    target: str
    other_id: str  # of its strongest rival: of the catalogue, "nothing", or "outside_the_list"
    other_target: str
    odds: float  # of the name against it
    odds_after: float = 0.0  # expected if the name is right, as the trial's nats are counted
    trial: str | None = None  # of the list of short trials
    plates: tuple[str, ...] = ()  # on which it is done
    words: str = ""  # what to do, with the plates' targets
    nats: float = 0.0  # that it is expected to say for the name against the rival, if the name is right
    nats_if_other: float = 0.0  # for the rival against the name, if the rival is right
    share_after: float = 0.0  # of the right one afterwards, averaged over which it is


@dataclass(frozen=True)
class AfterTrial:
    """What further trials decided of what was not sure without them."""

    asked: ToBeSure  # before
    trials: tuple[str, ...]  # that were recorded since
    decided: bool
    confidence: float  # of the name now; 0 where it is none any more


@dataclass(frozen=True)
class Remaining:
    """What is left after the named causes."""

    linear_residual_N: float
    noise_floor_N: float
    location: Location | None = None
    off_the_list: Unlisted | None = None


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong, verdict, causes, rivals, gain and remainder."""

    verdict: str
    effects: tuple[NamedEffect, ...]
    alternatives: tuple[Alternative, ...]
    gain: dict[str, Gain]
    remaining: Remaining
    trials: tuple[str, ...]
    residual: Residual | None = None  # without any cause
    evidence_nats: float = 0.0  # of all that was found, named or not, against nothing being wrong
    certain_nats: float = DiagnosisSettings.certain_gain  # from which on that is certain
    ended_early: bool = False  # the search, before all was tried, at the most evaluations
    rates_Hz: Mapping[str, float] = field(default_factory=dict)  # of the markers' frames, by trial
    starts_s: Mapping[str, float] = field(default_factory=dict)  # of frame 0 on the recording's clock
    notes: tuple[Note, ...] = field(default=())
    chances: Chances | None = None  # where nothing is named
    decisions: tuple[CauseDecisions, ...] = field(default=())  # of every cause that was proposed
    detectable: tuple[Detectable, ...] = field(default=())  # in a recording in which nothing is wrong
    to_be_sure: ToBeSure | None = None  # where a name is not sure
    direct_checks: tuple[Statement, ...] = field(default=())  # what the files say without a model of the body
