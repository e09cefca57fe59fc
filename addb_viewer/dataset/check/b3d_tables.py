"""A release's B3D files against its tables: the same numbers twice."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from jaxtyping import Float

from addb_viewer.dataset.check.finding import Finding, error
from addb_viewer.dataset.check.physics import GRAVITY, column, vector
from solver.capture.formats.b3d.reader import read_b3d
from solver.capture.formats.b3d.schema import B3dTrial
from solver.common.errors import CaptureError

LENGTH_M, ACCELERATION_M_S2, FORCE_N = 1e-5, 1e-3, 0.01  # single precision in one of the two


def b3d_table_findings(
    path: Path, trials: Sequence[tuple[str, pa.Table]], contact_bodies: Sequence[str]
) -> Iterator[Finding]:
    """Every segment of the tables is in the file, with the same numbers; no other is.

    Args:
        path: of the subject's file.
        trials: id and rows of `frames` of each of its trials.
        contact_bodies: right, left.
    """
    where = f"b3d/{path.name}"
    try:
        file = read_b3d(path)
        pieces = {(t.header.original_name, t.header.split_index): t for t in file.trials}
    except (CaptureError, OSError) as unreadable:
        yield error("b3d", where, str(unreadable).removeprefix(f"{path}: "))
        return
    bodies = list(file.header.ground_contact_body)
    if sorted(bodies) != sorted(contact_bodies):
        yield error("b3d", where, f"forces act on {', '.join(bodies)}, in the tables on others")
        return
    places = [bodies.index(name) for name in contact_bodies]
    for trial_id, frames in trials:
        segments = column(frames, "segment").astype(int)
        for number in np.unique(segments):
            name = trial_id.rsplit("/", 1)[-1], int(number)
            if name not in pieces:
                yield error("b3d", where, f"has no segment {number} of {trial_id}")
                continue
            off = _first_difference(pieces.pop(name), frames.filter(pa.array(segments == number)), places)
            if off:
                yield error("b3d", where, f"{trial_id}, segment {number}: {off}")
    for strange, number in pieces:
        yield error("b3d", where, f"has segment {number} of '{strange}', which the tables do not have")


def _first_difference(piece: B3dTrial, frames: pa.Table, places: Sequence[int]) -> str:
    """In words; empty where all numbers agree."""
    if piece.header.trial_length != frames.num_rows:
        return f"{piece.header.trial_length} frames, the table has {frames.num_rows}"
    if (np.array(piece.header.missing_GRF_reason) != column(frames, "missing_number")).any():
        return "missing_GRF_reason is not the table's"
    last = piece.passes[-1]
    wrench = np.array(last.ground_contact_wrench).reshape(frames.num_rows, -1, 6)[:, places, 3:]
    pairs: list[tuple[str, Any, Float[np.ndarray, "rows 3"], float]] = [
        ("com_pos", last.com_pos, vector(frames, "com_{}_m"), LENGTH_M),
        ("com_acc", last.com_acc, vector(frames, "com_a_{}_m_s2") - GRAVITY, ACCELERATION_M_S2),
    ]
    pairs += [
        (f"force on the {words} foot", wrench[:, k], vector(frames, f"grf_{side}_{{}}_N"), FORCE_N)
        for k, (side, words) in enumerate((("r", "right"), ("l", "left")))
    ]
    for name, held, told, limit in pairs:
        apart = np.abs(np.array(held) - told)
        apart[np.isnan(told)] = 0.0  # the format has zeros where a table has nothing
        if not apart.max(initial=0.0) <= limit:
            return f"{name} is off the table's by {np.nanmax(apart):.3g}"
    return ""
