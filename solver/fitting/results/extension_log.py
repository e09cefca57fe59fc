"""Which causes a person accepted as part of a subject's model: an append-only log beside the fit.

    results/extension_log.jsonl   one decision a line: accept or reject, which causes, by whom, when
    results/extension-2.npz       the wrenches that the second decision accepted

The last decision holds, whole: it names all causes that are accepted and all that are rejected, so that one
about a single cause repeats what was decided about the others. A line is on the disk after the wrenches that
it names; one that a killed run left unfinished was never made.
"""

import errno
import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from solver.capture.atomic import whole_file
from solver.common.disk_errors import writing_failed
from solver.common.errors import ResultsError
from solver.common.npz import stored_arrays
from solver.common.small_files import json_of
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.results.codec import Decoder, Encoder
from solver.fitting.results.writing import writing

FILE = "extension_log.jsonl"
ACCEPT, REJECT = "accept", "reject"
_TREE = "tree"


@dataclass(frozen=True)
class Decision:
    """What a person decided about the causes of a diagnosis."""

    kind: str  # accept: some are part of the model; reject: none is
    causes: tuple[Cause, ...]  # of which it is true
    by: str
    when: datetime
    made_from: Mapping[str, str]  # provenance of the recordings, without anybody's decisions
    left_out: tuple[str, ...] = ()  # causes that cannot be part of an extension, "id target"
    wrenches: str | None = None  # the file that holds them
    rejected: tuple[Cause, ...] = ()  # beside those that are accepted

    @property
    def standing(self) -> dict[tuple[str, str], str]:
        """By id and target, whether a cause is accepted or rejected; nothing of others is decided."""
        refused = dict.fromkeys(((cause.id, cause.target) for cause in self.rejected), REJECT)
        return refused | dict.fromkeys(((cause.id, cause.target) for cause in self.causes), self.kind)


@dataclass(frozen=True)
class Standing:
    """Who accepted or rejected one cause, and when."""

    kind: str
    by: str
    when: datetime


def standings(made: Sequence[Decision]) -> dict[tuple[str, str], Standing]:
    """By id and target, what holds about each cause, and who decided so first without another word since.

    Args:
        made: all decisions, the first one first.
    """
    held: dict[tuple[str, str], Standing] = {}
    for decision in made:
        new = Standing("", decision.by, decision.when)
        held = {
            key: held[key] if key in held and held[key].kind == kind else replace(new, kind=kind)
            for key, kind in decision.standing.items()
        }
    return held


def accept(
    results: Path,
    extension: Extension,
    *,
    by: str,
    made_from: Mapping[str, str],
    left_out: tuple[str, ...] = (),
    rejected: tuple[Cause, ...] = (),
) -> Decision:
    """Record that later solves are to use an extension.

    Args:
        results: the results folder, made where it is missing.
        extension: of the last diagnosis.
        by: who decides.
        made_from: provenance of the recordings that it was found in.
        left_out: causes of that diagnosis that are not in it.
        rejected: causes that somebody decided against.

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
        now = datetime.now(UTC)
        return _appended(
            results, Decision(ACCEPT, extension.named, by, now, made_from, left_out, name, rejected)
        )


def reject(results: Path, causes: tuple[Cause, ...], *, by: str, made_from: Mapping[str, str]) -> Decision:
    """Record that later solves are to use no extension.

    Args:
        results: the results folder, made where it is missing.
        causes: those that are rejected.
        by: who decides.
        made_from: provenance of the recordings that they were found in.

    Raises:
        ResultsError: the log cannot be read.
    """
    with writing(results):
        decisions(results)
        return _appended(results, Decision(REJECT, causes, by, datetime.now(UTC), made_from))


def reject_beside(results: Path, causes: tuple[Cause, ...], *, by: str) -> Decision:
    """Record that causes are rejected, while later solves use the same extension as before.

    Args:
        results: the results folder, in which an extension is accepted.
        causes: all that are rejected, in place of those that were.
        by: who decides.

    Raises:
        ResultsError: the log cannot be read.
    """
    with writing(results):
        last = decisions(results)[-1]
        assert last.kind == ACCEPT
        return _appended(results, replace(last, by=by, when=datetime.now(UTC), rejected=causes))


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
        "causes": plain_causes(decision.causes),
        "rejected": plain_causes(decision.rejected),
        "left_out": list(decision.left_out),
        "by": decision.by,
        "when": decision.when.isoformat(timespec="seconds"),
        "wrenches": decision.wrenches,
        "made_from": dict(decision.made_from),
    }


def plain_causes(causes: Sequence[Cause]) -> list[dict[str, Any]]:
    """Causes as JSON has them; what the recording says nothing about is None."""
    return [
        {
            "id": cause.id,
            "target": cause.target,
            "parameters": {
                name: {"value": v if isfinite(v) else None, "std": s if isfinite(s) else None}
                for name, (v, s) in cause.parameters.items()
            },
        }
        for cause in causes
    ]


def _causes(plain: Sequence[Mapping[str, Any]]) -> tuple[Cause, ...]:
    return tuple(
        Cause(
            c["id"],
            c["target"],
            {
                n: (nan_where_unknown(e["value"]), nan_where_unknown(e["std"]))
                for n, e in c["parameters"].items()
            },
        )
        for c in plain
    )


def nan_where_unknown(value: float | None) -> float:
    """JSON has no NaN: what nobody knows is None there."""
    return nan if value is None else value


def _decision(line: Mapping[str, Any]) -> Decision:
    if line["decision"] not in {ACCEPT, REJECT}:
        raise ValueError(f"'{line['decision']}' is neither {ACCEPT} nor {REJECT}")
    return Decision(
        line["decision"],
        _causes(line["causes"]),
        line["by"],
        datetime.fromisoformat(line["when"]),
        line["made_from"] if "made_from" in line else line["made_of"],  # as older lines call it
        tuple(line["left_out"]),
        line["wrenches"],
        _causes(line.get("rejected", ())),  # a line of an older version has none
    )
