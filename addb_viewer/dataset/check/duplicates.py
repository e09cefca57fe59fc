"""Trials that are in a release twice."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from addb_viewer.dataset.check.finding import Finding, error
from addb_viewer.dataset.check.physics import column, vector
from addb_viewer.dataset.same_recording import Places, Recording, recording_of

Pair = tuple[Recording, Recording]
MARKER_COLUMNS = ["trial_id", "marker", "frame", *(f"measured_{axis}_m" for axis in "xyz")]


def recording_in(
    trial_id: str, kinematics: pa.Table, markers: pa.Table, file: Path | None = None
) -> Recording | None:
    """A trial of a release as it is compared; None without frames or markers.

    Args:
        trial_id: of the trial.
        kinematics: its rows of that table.
        markers: likewise.
        file: that holds the markers' rows, to read them again; None: they are kept.
    """
    if not kinematics.num_rows or not markers.num_rows:
        return None
    frame, times = column(kinematics, "frame").astype(int), column(kinematics, "time_s")
    labels = tuple(sorted(set(markers["marker"].to_pylist())))

    def places(rows: pa.Table) -> Places:
        return Places(times - times[0], _placed(frame, labels, rows))

    def again() -> Places:
        if file is None:
            return places(markers)
        return places(pq.read_table(file, columns=MARKER_COLUMNS, filters=[("trial_id", "=", trial_id)]))

    return recording_of(trial_id, labels, places(markers), again)


def _placed(frame: np.ndarray, labels: tuple[str, ...], rows: pa.Table) -> np.ndarray:
    at = pc.index_in(rows["frame"], value_set=pa.array(frame, rows["frame"].type))
    which = pc.index_in(rows["marker"], value_set=pa.array(labels))
    at, which = (np.nan_to_num(one.to_numpy(), nan=-1).astype(int) for one in (at, which))
    placed, known = np.full((len(frame), len(labels), 3), np.nan), at >= 0
    placed[at[known], which[known]] = vector(rows, "measured_{}_m")[known]
    return placed


def duplicate_findings(pairs: Iterable[Pair], persons: Mapping[str, str]) -> Iterator[Finding]:
    """Every pair of trials that show the same recording.

    Args:
        pairs: of such trials.
        persons: by trial_id.
    """
    for one, other in pairs:
        same = persons[one.trial_id] == persons[other.trial_id]
        whose = "" if same else f", and they are called two persons ({persons[one.trial_id]} and another)"
        yield error("duplicates", one.trial_id, f"{copy_words(one, other)}{whose}")


def copy_words(one: Recording, other: Recording) -> str:
    """How a trial goes with another that shows the same.

    Args:
        one: of the pair.
        other: likewise.
    """
    kind = "the same recording as" if one.digest == other.digest else "a copy of a part of"
    return f"is {kind} {other.trial_id}"
