"""Which columns of a table belong to which force plate, whatever they are called."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.formats.storage import PlateColumns, Storage
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

FORCE, POINT, MOMENT = "force", "point", "moment"
KIND_OF_LETTERS = {"v": FORCE, "f": FORCE, "p": POINT, "cop": POINT, "m": MOMENT, "t": MOMENT}
KIND_OF_WORD = {
    **dict.fromkeys(("force", "forces", "grf"), FORCE),
    **dict.fromkeys(("torque", "torques", "moment", "moments", "grm", "freemoment"), MOMENT),
    **dict.fromkeys(("cop", "point", "position", "pressure"), POINT),
}
GROUND_WORDS = frozenset({"ground", "grf", "grm", "fp", "plate", "forceplate", "platform"})
FILLER_WORDS = frozenset({"reaction", "free", "center", "centre", "of"})
AXIS_TOKEN = re.compile(r"(v|f|p|cop|m|t|force|torque|moment|point)?([xyz])")


@dataclass(frozen=True)
class _Label:
    """A column name taken apart: `r_ground_force_vx` is plate ("r",), kind force, axis x."""

    text: str
    column: int
    plate: tuple[str, ...]
    kind: str
    axis: str
    of_ground: bool
    token: tuple[int, int]  # where in the text `vx` stands


def find_plates(storage: Storage) -> tuple[tuple[PlateColumns, ...], tuple[Note, ...]]:
    """Force plates of a table, by number where every plate has one, else in file order; and what is ignored.

    A column name is words and numbers: the axis with or without a letter for its kind (`vx`, `px`, `mx`,
    `tx`, `x`), words for force, point and moment, and what remains, which names the plate: nothing, a number,
    a side, a body.

    Raises:
        CaptureError: there is no force column, or a plate lacks one of its columns.
    """
    if storage.plates:
        return storage.plates, ()
    labels = [label for k, text in enumerate(storage.labels) if (label := _parse(text, k))]
    if any(label.of_ground and label.kind == FORCE for label in labels):
        labels = [label for label in labels if label.of_ground or label.kind != FORCE]
    plates = list(dict.fromkeys(label.plate for label in labels if label.kind == FORCE))
    if not plates:
        raise CaptureError(
            f"{storage.path}: no ground force among the columns {', '.join(storage.labels[:12])}; expected "
            "names such as ground_force_vx, R_ground_force_vx, ground_force_1_vx."
        )
    if all(len(plate) == 1 and plate[0].isdigit() for plate in plates):
        plates.sort(key=lambda plate: int(plate[0]))

    found: list[PlateColumns] = []
    missing: list[str] = []
    for plate in plates:
        members = [label for label in labels if label.plate == plate]
        force, point, moment = (_triple(members, kind, storage.path) for kind in (FORCE, POINT, MOMENT))
        gaps = _missing(force, point, moment)
        missing += gaps
        if not gaps:
            found.append(_plate(force, point, moment))
    if missing:
        columns = ", ".join(f"'{name}'" for name in missing)
        raise CaptureError(
            f"{storage.path}: column {columns} missing; plates found: {len(found)}"
            f"{' (' + ', '.join(plate.name for plate in found) + ')' if found else ''}. "
            "Export each plate with force, centre of pressure and moment along x, y and z."
        )
    used = {
        k
        for plate in found
        for triple in (plate.force, plate.point or (), plate.moment or ())
        for k in triple
        if k is not None
    }
    ignored = [text for k, text in enumerate(storage.labels) if k not in used]
    return tuple(found), _notes(storage.path.name, found, ignored)


def turn_table(storage: Storage, R_ground_lab: Float[np.ndarray, "3 3"]) -> Storage:
    """The table with forces, centres of pressure, moments and corners turned by a rotation."""
    values = storage.values.copy()
    for plate in find_plates(storage)[0]:
        for columns in (plate.force, plate.point, plate.moment):
            xyz = [column for column in columns or () if column is not None]
            if len(xyz) == 3:
                values[:, xyz] = storage.values[:, xyz] @ R_ground_lab.T
    plates = tuple(
        plate if plate.corners is None else replace(plate, corners=plate.corners @ R_ground_lab.T)
        for plate in storage.plates
    )
    return replace(storage, values=values, plates=plates)


def _parse(text: str, column: int) -> _Label | None:
    tokens = [(match[0].lower(), match.span()) for match in re.finditer(r"[A-Za-z]+|\d+", text)]
    axes = [k for k, (word, _) in enumerate(tokens) if AXIS_TOKEN.fullmatch(word)]
    if not axes:
        return None
    lettered = [k for k in axes if len(tokens[k][0]) > 1]
    place = (lettered or axes)[-1]
    match = AXIS_TOKEN.fullmatch(tokens[place][0])
    assert match
    words = [word for k, (word, _) in enumerate(tokens) if k != place]
    kinds = [KIND_OF_WORD[word] for word in words if word in KIND_OF_WORD]
    prefix = KIND_OF_LETTERS.get(match[1], KIND_OF_WORD.get(match[1])) if match[1] else None
    if prefix == POINT or not kinds or (prefix == MOMENT and MOMENT not in kinds):
        kind = prefix
    else:
        kind = next((k for k in kinds if k != FORCE), FORCE)
    if kind is None:
        return None
    plate = tuple(
        word for word in words if word not in KIND_OF_WORD and word not in GROUND_WORDS | FILLER_WORDS
    )
    of_ground = any(word in GROUND_WORDS for word in words)
    return _Label(text, column, plate, kind, match[2], of_ground, tokens[place][1])


def _triple(members: Sequence[_Label], kind: str, path: Path) -> dict[str, _Label]:
    triple: dict[str, _Label] = {}
    candidates = [label for label in members if label.kind == kind]
    if any(label.of_ground for label in candidates):
        candidates = [label for label in candidates if label.of_ground]
    for label in candidates:
        if label.axis in triple:
            raise CaptureError(
                f"{path}: columns '{triple[label.axis].text}' and '{label.text}' both look like the {kind} "
                f"along {label.axis} of one plate. Rename or remove one."
            )
        triple[label.axis] = label
    return triple


def _missing(force: dict[str, _Label], point: dict[str, _Label], moment: dict[str, _Label]) -> list[str]:
    """Names of the columns that this plate lacks."""
    names = [
        _sibling(triple, axis) for triple in (force, point) if triple for axis in "xyz" if axis not in triple
    ]
    if moment and set(moment) not in ({"y"}, set("xyz")):
        names += [_sibling(moment, axis) for axis in "xyz" if axis not in moment]
    if not point and set(moment) != set("xyz"):
        start, end = next(iter(force.values())).token
        text = next(iter(force.values())).text
        names += [f"{text[:start]}p{axis}{text[end:]}" for axis in "xyz"]
    return names


def _sibling(triple: dict[str, _Label], axis: str) -> str:
    """What the column of the same triple along `axis` would be called."""
    label = next(iter(triple.values()))
    end = label.token[1]
    letter = axis.upper() if label.text[end - 1].isupper() else axis
    return label.text[: end - 1] + letter + label.text[end:]


def _plate(force: dict[str, _Label], point: dict[str, _Label], moment: dict[str, _Label]) -> PlateColumns:
    x = force["x"]
    name = (x.text[: x.token[0]] + x.text[x.token[1] :]).strip("_-. ") or "force"
    return PlateColumns(
        name=name,
        force=(force["x"].column, force["y"].column, force["z"].column),
        point=(point["x"].column, point["y"].column, point["z"].column) if point else None,
        moment=(
            moment["x"].column if "x" in moment else None,
            moment["y"].column,
            moment["z"].column if "z" in moment else None,
        )
        if moment
        else None,
    )


def _notes(source: str, plates: Sequence[PlateColumns], ignored: Sequence[str]) -> tuple[Note, ...]:
    notes: tuple[Note, ...] = ()
    for plate in plates:
        if plate.moment is None:
            notes += noted(
                Kind.PLATES, f"{source}: {plate.name} has no moment columns; its free moment is taken as zero"
            )
        elif None in plate.moment:
            notes += noted(
                Kind.PLATES, f"{source}: {plate.name} has a vertical moment only, taken as the free moment"
            )
    if ignored:
        notes += noted(
            Kind.PLATES,
            f"{source}: columns ignored, since they belong to no force plate: {', '.join(ignored)}",
        )
    return notes
