"""Which causes a person accepted as part of a subject's model: an append-only log beside the fit.

    results/extension_log.jsonl   one decision a line: accept or reject, which causes, by whom, when
    results/extension-2.npz       the wrenches that the second decision accepted

The last decision holds. A line is on the disk after the wrenches that it names; one that a killed run left
unfinished was never made.
"""

import errno
import io
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from solver.capture.atomic import whole_file
from solver.capture.disk_errors import writing_failed
from solver.capture.npz import stored_arrays
from solver.capture.small_files import json_of
from solver.dynamics.extension import Cause, Extension
from solver.errors import ResultsError
from solver.results.codec import Decoder, Encoder
from solver.results.writing import writing

FILE = "extension_log.jsonl"
ACCEPT, REJECT = "accept", "reject"
_TREE = "tree"


@dataclass(frozen=True)
class Decision:
    """What a person decided about the causes of a diagnosis."""

    kind: str  # accept or reject
    causes: tuple[Cause, ...]
    by: str
    when: datetime
    made_of: Mapping[str, str]  # provenance of the recordings, without anybody's decisions
    left_out: tuple[str, ...] = ()  # causes that cannot be part of an extension, "id target"
    wrenches: str | None = None  # the file that holds them


def accept(
    results: Path,
    extension: Extension,
    *,
    by: str,
    made_of: Mapping[str, str],
    left_out: tuple[str, ...] = (),
) -> Decision:
    """Record that later solves are to use an extension.

    Args:
        results: the results folder, made where it is missing.
        extension: of the last diagnosis.
        by: who decides.
        made_of: provenance of the recordings that it was found in.
        left_out: causes of that diagnosis that are not in it.

    Raises:
        ResultsError: the log cannot be read.
        CaptureError: the folder cannot be written to.
    """
    encoder = Encoder(results)
    tree = json.dumps(encoder.encode(extension), allow_nan=False)
    packed = io.BytesIO()
    np.savez_compressed(packed, allow_pickle=False, **{_TREE: np.array(tree)}, **encoder.arrays)
    with writing(results):
        name = _next_name(results)
        with whole_file(results / name) as file:
            file.write(packed.getvalue())
        return _appended(
            results, Decision(ACCEPT, extension.named, by, datetime.now(UTC), made_of, left_out, name)
        )


def reject(results: Path, causes: tuple[Cause, ...], *, by: str, made_of: Mapping[str, str]) -> Decision:
    """Record that later solves are to use no extension.

    Args:
        results: the results folder, made where it is missing.
        causes: those that are rejected.
        by: who decides.
        made_of: provenance of the recordings that they were found in.

    Raises:
        ResultsError: the log cannot be read.
    """
    with writing(results):
        decisions(results)
        return _appended(results, Decision(REJECT, causes, by, datetime.now(UTC), made_of))


def decisions(results: Path) -> tuple[Decision, ...]:
    """All decisions, the first one first.

    Raises:
        ResultsError: a line before the last is not one of ours.
    """
    path = results / FILE
    if not path.is_file():
        return ()
    *lines, _unfinished = path.read_text(encoding="utf-8").split("\n")
    found = []
    for number, line in enumerate(lines, start=1):
        try:
            found.append(_decision(json_of(line)))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ResultsError(
                f"{path}, line {number}: not a decision ({error}). Restore the file, or move it away and "
                "decide anew: addb-viewer accept"
            ) from error
    return tuple(found)


def accepted(results: Path) -> tuple[Decision, Extension] | None:
    """The extension that holds, and the decision for it; None where there is none.

    Raises:
        ResultsError: the log or the wrenches cannot be read.
    """
    made = decisions(results)
    if not made or made[-1].kind != ACCEPT or made[-1].wrenches is None:
        return None
    path = results / made[-1].wrenches
    try:
        arrays = stored_arrays(path)
        return made[-1], Decoder(results, arrays).decode(json_of(str(arrays.pop(_TREE))))
    except (OSError, ValueError, KeyError, RecursionError, ResultsError) as error:
        raise ResultsError(
            f"{path}: cannot be read ({error}). Decide anew: addb-viewer diagnose, then accept or reject"
        ) from error


def _next_name(results: Path) -> str:
    """A file that no decision has; without locks, another program may have taken a number already."""
    number = len(decisions(results)) + 1
    while (results / f"extension-{number}.npz").exists():
        number += 1
    return f"extension-{number}.npz"


def _appended(results: Path, decision: Decision) -> Decision:
    """Write one line in one go, on a line of its own even after one that was left unfinished."""
    path = results / FILE
    kept = path.read_bytes() if path.is_file() else b""
    if kept and not kept.endswith(b"\n"):
        with whole_file(path) as file:
            file.write(kept[: kept.rfind(b"\n") + 1])
    line = json.dumps(_plain(decision), ensure_ascii=False, allow_nan=False) + "\n"
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            if os.write(handle, line.encode()) < len(line.encode()):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # the next decision removes the half
            os.fsync(handle)
        finally:
            os.close(handle)
    except OSError as error:
        raise ResultsError(writing_failed(path, error)) from error
    return decision


def _plain(decision: Decision) -> dict[str, Any]:
    return {
        "decision": decision.kind,
        "causes": [
            {
                "id": cause.id,
                "target": cause.target,
                "parameters": {n: {"value": v, "std": s} for n, (v, s) in cause.parameters.items()},
            }
            for cause in decision.causes
        ],
        "left_out": list(decision.left_out),
        "by": decision.by,
        "when": decision.when.isoformat(timespec="seconds"),
        "wrenches": decision.wrenches,
        "made_of": dict(decision.made_of),
    }


def _decision(line: Mapping[str, Any]) -> Decision:
    if line["decision"] not in {ACCEPT, REJECT}:
        raise ValueError(f"'{line['decision']}' is neither {ACCEPT} nor {REJECT}")
    causes = tuple(
        Cause(c["id"], c["target"], {n: (e["value"], e["std"]) for n, e in c["parameters"].items()})
        for c in line["causes"]
    )
    return Decision(
        line["decision"],
        causes,
        line["by"],
        datetime.fromisoformat(line["when"]),
        line["made_of"],
        tuple(line["left_out"]),
        line["wrenches"],
    )
