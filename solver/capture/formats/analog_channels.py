"""EMG, triggers and other signals of a C3D file that belong to no force plate, as the file has them.

They are read from the trial's files when somebody asks. Like plates, the first sample is at 0 s.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.formats.c3d_contents import C3dContents, open_c3d, parameters_in
from solver.capture.formats.text_table import some_of, unique_names
from solver.capture.plates.force_platform import CHANNELS_OF_TYPE
from solver.common.errors import CaptureError

ENTRIES = 255  # of a parameter
Parameters = dict[str, tuple[str, ...]]


@dataclass(frozen=True)
class AnalogChannels:
    """Signals with one clock: in their own units, nothing filtered, scaled or taken off."""

    names: tuple[str, ...]  # the file's, repeats numbered; "channel 7" where the file has none
    units: tuple[str, ...]  # as the file writes them; may be empty
    values: Float[np.ndarray, "samples channels"]
    rate: float  # [Hz]
    start_time: float = 0.0  # [s] on the markers' clock

    @property
    def times(self) -> Float[np.ndarray, " samples"]:
        """Time of each sample on the recording's clock [s]."""
        return self.start_time + np.arange(len(self.values)) / self.rate

    @property
    def labels(self) -> tuple[str, ...]:
        """Names that end with the unit, as columns of a table beside `time_s`; no two alike."""
        columns = [
            f"{name}_{unit}" if unit else name for name, unit in zip(self.names, self.units, strict=True)
        ]
        return unique_names(["time_s", *columns])[0][1:]

    @property
    def columns(self) -> dict[str, Float[np.ndarray, " samples"]]:
        """A table with a row a sample."""
        return {"time_s": self.times, **dict(zip(self.labels, self.values.T, strict=True))}


def channels_listed(files: Sequence[Path]) -> tuple[tuple[str, str], ...]:
    """Name and unit of the channels of a trial's files; no sample is read."""
    source = _source(files)
    if source is None:
        return ()
    found = _parameters(source)
    return tuple((name, unit) for _, name, unit in _others(found, _number(found, "ANALOG:USED")))


def read_analog(files: Sequence[Path], names: Collection[str] | None = None) -> AnalogChannels | None:
    """The channels of a trial's files: of the first C3D file that has some; None where none has.

    Args:
        files: of the trial, that of the markers first.
        names: only these; None: all.

    Raises:
        CaptureError: the file cannot be read, or has no channel of such a name.
    """
    source = _source(files)
    return None if source is None else analog_in(open_c3d(source), names)


def analog_or_why_not(files: Sequence[Path]) -> tuple[AnalogChannels | None, tuple[str, ...]]:
    """Likewise, for who writes them beside what a fit knows: what keeps them from being read is a note."""
    try:
        return read_analog(files), ()
    except CaptureError as error:
        return None, (f"analog channels are not written: {error}",)


def analog_in(contents: C3dContents, names: Collection[str] | None = None) -> AnalogChannels | None:
    """Likewise of a file that is open.

    Raises:
        CaptureError: it has no channel of such a name.
    """
    found = [
        (column, name, unit)
        for column, name, unit in _others(_parameters(contents.path), contents.analogs.shape[1])
        if names is None or name in names
    ]
    unknown = sorted(set(names or ()) - {name for _, name, _ in found})
    if unknown:
        raise CaptureError(
            f"{contents.path}: has no analog channel {some_of(unknown)}. Choose from the list again."
        )
    if not found or not contents.samples_per_frame:
        return None
    columns, labels, units = zip(*found, strict=True)
    return AnalogChannels(
        labels, units, contents.analogs[:, list(columns)], contents.rate * contents.samples_per_frame
    )


def _source(files: Sequence[Path]) -> Path | None:
    for file in files:
        if file.suffix.lower() == ".c3d":
            found = _parameters(file)
            if next(_others(found, _number(found, "ANALOG:USED")), None) is not None:
                return file
    return None


def _parameters(file: Path) -> Parameters:
    try:
        return parameters_in(file, ("ANALOG", "FORCE_PLATFORM"))
    except OSError as error:
        raise CaptureError(f"{file}: cannot be read ({error.strerror}).") from error


def _others(found: Parameters, count: int) -> Iterator[tuple[int, str, str]]:
    """Column, name and unit of the channels that belong to no platform, of so many."""
    labels, units = _texts(found, "LABELS"), _texts(found, "UNITS")
    platforms = _of_platforms(found)
    columns = [column for column in range(count) if column + 1 not in platforms]
    named = [labels[c] if c < len(labels) and labels[c] else f"channel {c + 1}" for c in columns]
    for column, name in zip(columns, unique_names(named)[0], strict=True):
        yield column, name, units[column] if column < len(units) else ""


def _of_platforms(found: Parameters) -> set[int]:
    """Numbers of the channels of all platforms, from 1."""
    kinds, listed = found.get("FORCE_PLATFORM:TYPE", ()), found.get("FORCE_PLATFORM:CHANNEL", ())
    if not kinds:
        return set()
    rows = len(listed) // len(kinds)
    used = min(_number(found, "FORCE_PLATFORM:USED"), len(kinds))
    numbers: set[int] = set()
    for k, kind in enumerate(kinds[:used]):
        count = CHANNELS_OF_TYPE.get(round(float(kind)), rows)
        numbers |= {round(float(channel)) for channel in listed[k * rows : k * rows + min(count, rows)]}
    return numbers


def _texts(found: Parameters, name: str) -> list[str]:
    """A parameter with its continuation in NAME2, NAME3 and so on, each of which goes on behind 255 more."""
    texts, part = list(found.get(f"ANALOG:{name}", ())), 2
    while f"ANALOG:{name}{part}" in found:
        texts += [""] * (ENTRIES * (part - 1) - len(texts))  # texts without a letter are no text at all
        texts += found[f"ANALOG:{name}{part}"]
        part += 1
    return texts


def _number(found: Parameters, name: str) -> int:
    return round(float(next(iter(found.get(name, ())), "0")))
