"""markers.toml: what each label of a subject means, written for a person to correct, and read again."""

import json
from collections.abc import Mapping
from pathlib import Path

from solver.capture.atomic import write_whole
from solver.capture.capture import Subject
from solver.common.errors import CaptureError
from solver.common.small_files import BrokenFileError, toml_tables
from solver.markers.atlas import atlas
from solver.markers.understanding import Understanding, UnderstoodLabel

TABLE = "markers"
_HEAD = """\
# What the labels of the recordings mean: label = "landmark", or "" to leave it out of the fit.
# Correct what is wrong and fit again. `addb-viewer markers --landmarks` lists the landmarks; for a model of
# your own, its markers' names can be used as well. Labels that are missing here are interpreted again.
"""


def read_map(path: Path) -> dict[str, str]:
    """Label to landmark, marker of the model, or "".

    Raises:
        CaptureError: the file is missing, no TOML, or holds something else.
    """
    try:
        tables = toml_tables(path)
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read ({error.strerror}).") from error
    except BrokenFileError as error:
        raise CaptureError(f"{path}: {error}") from error
    strange = [key for key in tables if key != TABLE]
    rows = tables.get(TABLE)
    if strange or not isinstance(rows, dict):
        raise CaptureError(f'{path}: one table [{TABLE}] is needed with lines like "LASI" = "asis_l".')
    for label, target in rows.items():
        if isinstance(target, dict):
            raise CaptureError(
                f'{path}: a label with dots or spaces needs quotes: "{_dotted(label, target)}" = "landmark".'
            )
        if not isinstance(target, str):
            raise CaptureError(f"{path}: {label} = {target!r}: the name of a landmark in quotes is needed.")
    return {label: target.strip() for label, target in rows.items()}


def _dotted(label: str, rest: Mapping[str, object]) -> str:
    """The label that TOML took apart at its dots."""
    inner, value = next(iter(rest.items()), ("", ""))
    return f"{label}.{_dotted(inner, value) if isinstance(value, dict) else inner}"


def chosen_for(subject: Subject) -> dict[str, str]:
    """The map that goes with a subject; empty where there is none."""
    return read_map(subject.marker_map) if subject.marker_map is not None else {}


def map_text(
    understanding: Understanding, kept: Mapping[str, str], on_model: Mapping[str, str] | None = None
) -> str:
    """The file's content.

    Args:
        understanding: of all labels.
        kept: what a person said before; it stays, by label.
        on_model: with a model of the subject's own, its marker for each label that it knows; lines of other
            labels are comments, because landmarks mean nothing to it.
    """
    family = f"# Most labels are those of: {understanding.family}.\n" if understanding.family else ""
    rows = [
        _line(row, kept) if on_model is None else _line_on_model(row, kept, on_model)
        for row in understanding.labels
    ]
    gone = [
        f"{json.dumps(label)} = {json.dumps(t)}"
        for label, t in kept.items()
        if label not in understanding.by_label()
    ]
    return "\n".join([f"{_HEAD}{family}\n[{TABLE}]", *rows, *gone, ""])


def write_map(
    path: Path,
    understanding: Understanding,
    kept: Mapping[str, str],
    on_model: Mapping[str, str] | None = None,
) -> None:
    """Write the file whole or not at all."""
    write_whole(path, map_text(understanding, kept, on_model))


def _line(row: UnderstoodLabel, kept: Mapping[str, str]) -> str:
    label = json.dumps(row.label, ensure_ascii=False)
    if row.label in kept:
        return f"{label} = {json.dumps(kept[row.label], ensure_ascii=False)}  # as you wrote"
    target = row.landmark if row.used else ""
    return f"{label} = {json.dumps(target)}  # {remark(row)}"


def _line_on_model(row: UnderstoodLabel, kept: Mapping[str, str], on_model: Mapping[str, str]) -> str:
    if row.label in kept or row.label not in on_model:
        line = _line(row, kept)
        return line if row.label in kept else f"# {line}; its name is not one of the model's markers"
    label = json.dumps(row.label, ensure_ascii=False)
    return f"{label} = {json.dumps(on_model[row.label], ensure_ascii=False)}  # the model's marker"


def remark(row: UnderstoodLabel) -> str:
    """Confidence, place and alternatives of a label in one line."""
    if row.landmark is None:
        return "left out, no marker" if row.computed else "unknown"
    parts = [f"{row.confidence:.2f}", atlas()[row.landmark].says]
    if not row.used:
        reason = f"the same place as {row.same_as}" if row.same_as else "too uncertain"
        parts.insert(1, f"left out, {reason}; {row.landmark}?")
    if row.alternatives:
        parts.append("or " + ", ".join(f"{name} {p:.2f}" for name, p in row.alternatives))
    return "; ".join(parts)
