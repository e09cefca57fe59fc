"""What was measured, as one trial and as one subject: SI units, ground frame, y up."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.formats.b3d.stored import StoredPass
from solver.common.file_names import readable
from solver.common.notes import Note

Side = Literal["Left", "Right", "General"]
FootEventLabel = Literal["Foot Strike", "Foot Off"]


@dataclass(frozen=True)
class FootEvent:
    """A foot meets or leaves the ground, in the words of C3D files."""

    time_s: float  # on the recording's clock
    side: Side
    label: FootEventLabel


@dataclass(frozen=True)
class Markers:
    """Marker trajectories of one trial.

    `positions_ground` is NaN where a marker was not seen; `rate` [Hz] comes from the time column.
    """

    names: tuple[str, ...]
    positions_ground: Float[np.ndarray, "frames markers 3"]  # [m]
    rate: float  # [Hz]
    start_time: float = 0.0  # [s] time of frame 0 on the recording's clock
    first_frame: int = 0  # of the recording; beyond 0 where these are a part of it
    foot_events: tuple[FootEvent, ...] = ()  # that the file states

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.positions_ground.shape[0]

    @property
    def times(self) -> Float[np.ndarray, " frames"]:
        """Time of each frame on the recording's clock [s]."""
        return self.start_time + np.arange(self.frames) / self.rate

    def chosen(self, columns: Sequence[int]) -> "Markers":
        """Only the markers of these columns, in this order."""
        names = tuple(self.names[column] for column in columns)
        return replace(self, names=names, positions_ground=self.positions_ground[:, list(columns)])


@dataclass(frozen=True)
class ForcePlate:
    """One force plate as measured: the wrench that the ground exerts ON the person, at the plate's own rate.

    `moment_ground` is about the ground origin; with `cop_ground` NaN while the plate is unloaded. Where a
    file has columns of its own for centres of pressure, `point_ground` keeps them whatever the force beside.
    """

    name: str  # the file's own column prefix or channel, for messages and the screen
    force_ground: Float[np.ndarray, "samples 3"]  # [N]
    moment_ground: Float[np.ndarray, "samples 3"]  # [N·m] about the ground origin
    cop_ground: Float[np.ndarray, "samples 3"]  # [m] NaN while unloaded
    rate: float  # [Hz]
    start_time: float = 0.0  # [s] on the same clock as the markers
    corners_ground: Float[np.ndarray, "4 3"] | None = None  # [m]
    point_ground: Float[np.ndarray, "samples 3"] | None = None  # [m] NaN where the file says "none"
    zero_ground: Float[np.ndarray, "6"] | None = None  # [N, N·m] its zero level, which reading took off

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.force_ground.shape[0]

    @property
    def times(self) -> Float[np.ndarray, " samples"]:
        """Time of each sample on the recording's clock [s]."""
        return self.start_time + np.arange(self.samples) / self.rate

    def unrecorded_at(self, samples: Bool[np.ndarray, " samples"]) -> "ForcePlate":
        """The plate with NaN for everything that it read at these samples."""
        known = np.where(samples, np.nan, 1.0)[:, None]
        return replace(
            self,
            force_ground=self.force_ground * known,
            moment_ground=self.moment_ground * known,
            cop_ground=self.cop_ground * known,
            point_ground=None if self.point_ground is None else self.point_ground * known,
        )


class ImportedReason(NamedTuple):
    """Why the file leaves out the forces of frames start to end − 1, by the names of the B3D format."""

    start: int
    end: int
    reason: str


@dataclass(frozen=True)
class Capture:
    """One trial as measured."""

    name: str
    markers: Markers
    plates: tuple[ForcePlate, ...] = ()
    notes: tuple[Note, ...] = ()  # what was assumed, converted or ignored on the way in
    files: tuple[Path, ...] = ()
    imported_missing_force: Bool[np.ndarray, " frames"] | None = None  # review.json: true = force missing
    imported_reviewed: Bool[np.ndarray, " frames"] | None = None  # frames that it is about; None: all
    outside_ranges: Bool[np.ndarray, " frames"] | None = (
        None  # true: in no range of the trial; None: all counts
    )
    stored: tuple[StoredPass, ...] = ()  # what the file itself says of its passes; nothing of it is used
    imported_reasons: tuple[ImportedReason, ...] = ()  # of the missing frames, where the file names reasons
    prefix: str = ""  # before the labels in the file, as in PREFIX:LASI


@dataclass(frozen=True)
class PlateWord:
    """What a person said of one force plate of a trial, against whatever its recording seems to tell."""

    name: str  # of the plate, as notes call it
    sign: int | None = None  # +1: it reads the force on the person, -1: the force on the plate
    zero_N: float | None = None  # [N] that it reads vertically, in the file's own sign, while nobody is on it


@dataclass(frozen=True)
class TrialFiles:
    """Where one trial of a subject lies; opened by `read_trial`."""

    name: str
    markers: Path
    forces: Path | None = None
    reviews: tuple[Path, ...] = ()  # review.json of the segments in order
    up: str | None = None  # "z", "-y": the laboratory's axis that points up, where a person said so
    moments: str | None = None  # "free", "plate", "ground": what moment columns mean, where a person said so
    plates: tuple[PlateWord, ...] = ()  # of those about which a person said something
    ranges: tuple[tuple[float, float], ...] = ()  # [s] whose forces are to be used; empty: the whole trial
    prefix: str | None = None  # before the person's labels, in a file of several people
    inner_review_finished: bool | None = None  # of a review in the recording's own file; None: it has none

    @property
    def has_review(self) -> bool:
        """Whether files that came with the recording say which forces count."""
        return bool(self.reviews) or self.inner_review_finished is not None


@dataclass(frozen=True)
class UnusedFile:
    """A file of a subject's folder that no fit of it reads."""

    file: str  # from the subject's folder; of a folder of others, with a slash behind
    reason: str
    harm: int  # 0: what is lost matters most (forces), then markers, models, reviews, the rest


@dataclass(frozen=True)
class UnreadTrial:
    """A trial that a fit went without, since a file of it cannot be read."""

    name: str  # of the trial; empty for the static trial
    file: UnusedFile


@dataclass(frozen=True)
class ReleaseWords:
    """What a subject.toml says for releases, under [release]; None where it is silent."""

    source: str | None = None  # publication or laboratory's collection
    person: str | None = None  # None: the folder's name
    laboratory: str | None = None
    licence: str | None = None  # SPDX identifier or URL
    consent: str | None = None  # "public", "restricted", "unknown"
    citation: str | None = None  # BibTeX or text
    doi: str | None = None  # without https://doi.org/
    url: str | None = None


Wanted = Literal["trials", "walks", "runs", "steps", "right_steps", "left_steps"]


@dataclass(frozen=True)
class PlanItem:
    """So many good ones of something are to be recorded of a subject, by its subject.toml."""

    wanted: Wanted
    count: int


NAMES_OF_NOBODY = ("results", "result", "output", "subject", "data", "export")
"""What programs call a file whoever is in it."""


@dataclass(frozen=True)
class Subject:
    """One person's folder: who, which model, which trials. Nothing is loaded yet but the description."""

    folder: Path
    trials: tuple[TrialFiles, ...]
    mass_kg: float | None = None
    height_m: float | None = None
    sex: str | None = None  # "male", "female" or None
    age_years: float | None = None
    model: Path | None = None  # None: the default full body
    model_is: str | None = (
        None  # "scaled": this person's own; "generic"; "stored": in `recording`; None: look
    )
    static: Path | None = None
    marker_map: Path | None = None  # what labels mean, as a person corrected it
    foot_bodies: tuple[str, ...] = ("calcn_r", "calcn_l")
    tags: tuple[str, ...] = ()
    notes: tuple[Note, ...] = field(default=())
    unused: tuple[UnusedFile, ...] = ()  # the most harmful first
    recording: Path | None = None  # the one file that holds all trials; `folder` then keeps decisions only
    release: ReleaseWords | None = None
    prefix: str | None = None  # before the person's labels, in files of several people
    other_statics: tuple[Path, ...] = ()  # static trials that are not used
    plan: tuple[PlanItem, ...] = ()  # what is to be recorded; empty where nobody said
    awaited: tuple[Path, ...] = ()  # files that subject.toml names and that are not there yet
    scale_factor: float | None = None  # a scale's reading over the mass that was entered; None: no scale
    is_described: bool = True  # somebody says that the trials are one person's

    @property
    def name(self) -> str:
        """The name of the folder; of a single file its own, or its folder's where that tells nobody."""
        if self.recording is None:
            return readable(self.folder.resolve().name)
        file = self.recording.resolve()
        return readable(file.parent.name if file.stem.lower() in NAMES_OF_NOBODY else file.stem)
