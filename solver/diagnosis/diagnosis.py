"""Parts of what a diagnosis says."""

from dataclasses import dataclass

EXPLAINED, CLEAN, UNEXPLAINED = "explained", "clean", "unexplained"


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
    trials: tuple[str, ...]  # that were recorded since; none: a scale was read
    decided: bool
    confidence: float  # of the name now; 0 where it is none any more


@dataclass(frozen=True)
class Remaining:
    """What is left after the named causes."""

    linear_residual_N: float
    noise_floor_N: float
    location: Location | None = None
    off_the_list: Unlisted | None = None
