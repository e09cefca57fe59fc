"""Our frozen dataclasses as JSON and plain arrays, and back: no pickle, no class that isn't listed here."""

import os
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from solver.capture import capture
from solver.capture.formats.b3d import stored
from solver.common.errors import ResultsError
from solver.common.file_names import lying
from solver.common.notes import Note, NoteJson
from solver.contact import detected_ranges, wrenches
from solver.dynamics import com_trajectory, dynamics
from solver.dynamics.cross_validation import held_out
from solver.dynamics.force_prediction import learnt_terms
from solver.dynamics.trajectory import extension
from solver.fitting.fit_result import Groundwork, KinematicsOnly, SettledFit, TrialFit
from solver.kinematics import marker_errors, marker_matching, motion
from solver.kinematics.label_faults import fault
from solver.skeleton import functions, skeleton

Tree = Any  # what JSON can hold
Arrays = dict[str, np.ndarray]

_MODULES = (
    capture,
    stored,
    wrenches,
    detected_ranges,
    com_trajectory,
    dynamics,
    held_out,
    learnt_terms,
    extension,
    fault,
    marker_errors,
    marker_matching,
    motion,
    functions,
    skeleton,
)
_TYPES = {
    name: kind
    for disk_space in _MODULES
    for name, kind in vars(disk_space).items()
    if isinstance(kind, type) and is_dataclass(kind) and kind.__module__ == disk_space.__name__
} | {
    "TrialFit": TrialFit,
    "KinematicsOnly": KinematicsOnly,
    "Groundwork": Groundwork,
    "SettledFit": SettledFit,
}


class Encoder:
    """Turns values into a tree for JSON.

    Arrays go into `arrays` under their dotted place in the value ("motion.q"), or into the tree itself where
    `inline` is set. Paths are kept relative to `base`, so that a subject's folder can be moved.
    """

    def __init__(self, base: Path, *, inline: bool = False) -> None:
        self.base = base
        self.inline = inline
        self.arrays: Arrays = {}

    def encode(self, value: object, place: str = "") -> Tree:
        """The tree of a value that sits at `place`."""
        if isinstance(value, np.ndarray):
            return self._array(value, place)
        if isinstance(value, np.generic):
            return self.encode(value.item(), place)
        if isinstance(value, float) and not np.isfinite(value):
            return {"float": repr(value)}
        if isinstance(value, Note):
            return {"note": value.as_json()}
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, Path):
            return {"path": _relative(value, self.base)}
        if isinstance(value, tuple | list):
            return [self.encode(item, f"{place}.{i}") for i, item in enumerate(value)]
        if isinstance(value, Mapping):
            return {"dict": {str(key): self.encode(item, f"{place}.{key}") for key, item in value.items()}}
        if is_dataclass(value) and type(value).__name__ in _TYPES:
            return {"type": type(value).__name__, "fields": self._fields(value, place)}
        raise TypeError(f"{place}: no way to save a {type(value).__name__}")

    def _fields(self, value: Any, place: str) -> dict[str, Tree]:
        return {
            f.name: self.encode(getattr(value, f.name), f"{place}.{f.name}" if place else f.name)
            for f in fields(value)
        }

    def _array(self, value: np.ndarray, place: str) -> Tree:
        if self.inline:
            return {"array": self.encode(value.tolist(), place)}
        self.arrays[place] = value
        return {"stored": place}


class Decoder:
    """Turns a tree back into values; sequences come back as tuples."""

    def __init__(self, base: Path, arrays: Mapping[str, np.ndarray] | None = None) -> None:
        self.base = base
        self.arrays = arrays or {}

    def decode(self, tree: Tree) -> Any:
        """The value of a tree.

        Raises:
            ResultsError: the tree names a type, field or array that isn't there.
        """
        if isinstance(tree, list):
            return tuple(self.decode(item) for item in tree)
        if not isinstance(tree, dict):
            return tree
        match tree:
            case {"type": str(name), "fields": dict(members)}:
                return self._instance(name, members)
            case {"stored": str(place)}:
                return self._stored(place)
            case {"array": items}:
                return np.array(self.decode(items))
            case {"note": dict(stored)}:
                return Note.from_json(cast(NoteJson, stored))
            case {"float": str(text)}:
                return float(text)
            case {"path": str(text)}:
                return (
                    Path(os.path.normpath(self.base / text))
                    if text.startswith("..")
                    else lying(self.base, text)
                )
            case {"dict": dict(items)}:
                return {key: self.decode(item) for key, item in items.items()}
        raise ResultsError(f"not written by this version: {sorted(tree)}")

    def _instance(self, name: str, members: dict[str, Tree]) -> Any:
        if name not in _TYPES:
            raise ResultsError(f"not written by this version: unknown type '{name}'")
        try:
            return _TYPES[name](**{key: self.decode(item) for key, item in members.items()})
        except TypeError as error:
            raise ResultsError(f"not written by this version: {error}") from error

    def _stored(self, place: str) -> np.ndarray:
        if place not in self.arrays:
            raise ResultsError(f"array '{place}' is missing")
        return self.arrays[place]


def _relative(path: Path, base: Path) -> str:
    """From `base`, with ".." where needed; as it is where no relative path exists (another drive)."""
    try:
        return Path(os.path.relpath(path, base)).as_posix()
    except ValueError:
        return str(path.absolute())
