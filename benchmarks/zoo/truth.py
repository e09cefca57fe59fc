"""What is so of a set of recordings: its truth file, or the subject.toml that describes it.

Times are seconds from the first frame of the file. What is None or empty is unknown, and is not checked.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

Interval = tuple[float, float]  # [s], from and to
Contact = tuple[str, float, float]  # foot "R", "L" or "-" (unknown, both), from and to [s]

MASS_WITHIN = 0.10  # of a mass that the laboratory states
LOADED_N = 50.0  # beyond what empty plates read


@dataclass(frozen=True)
class PlateTruth:
    """A force plate of a C3D file: its level while nobody is on it, and who stands on it when."""

    zero_N: float
    tolerance_N: float
    loaded: tuple[Contact, ...]


@dataclass(frozen=True)
class PersonTruth:
    """Somebody in the set."""

    mass_kg: Interval | None = None  # value, tolerance
    height_m: Interval | None = None
    static: tuple[str, ...] | None = None  # trials any of which will do; "" for none; None: not checked
    trials: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrialTruth:
    """One trial of the set."""

    name: str
    files: tuple[str, ...]  # any of these holds its markers
    frames: int | None = None
    seen: tuple[Interval, ...] | None = None  # None: not checked
    plates: Mapping[int, PlateTruth] = field(default_factory=dict)
    listed_until_s: float | None = None  # contacts are listed until then only
    partly: tuple[Contact, ...] = ()
    off_plate: tuple[Contact, ...] = ()
    plates_dead: bool = False
    force_offset_ms: Interval | None = None  # value, tolerance: how much too early the forces are
    computed_points: tuple[str, ...] = ()  # regular expressions
    included: tuple[tuple[str, str, str, str], ...] = ()  # coordinate and three markers
    reference: tuple[str, ...] = ()

    @property
    def loaded(self) -> tuple[Contact, ...]:
        """Of all plates."""
        return tuple(contact for plate in self.plates.values() for contact in plate.loaded)


@dataclass(frozen=True)
class Truth:
    """A set of recordings."""

    persons: int = 1
    usable: str = "torques"
    why: str = ""
    format_told: tuple[str, ...] = ()
    legs: bool = True
    trial_count: int | None = None
    not_body: tuple[str, ...] = ()
    choose: tuple[str, ...] = ()
    extra_forces: tuple[str, ...] = ()
    people: tuple[PersonTruth, ...] = ()
    trials: tuple[TrialTruth, ...] = ()
    wrong_if: Mapping[str, Any] = field(default_factory=dict)


def read_truth(file: Path) -> Truth:
    """A set's truth file; its schema stands beside the files."""
    told = tomllib.loads(file.read_text(encoding="utf-8"))
    about = {("trial_count" if key == "ntrials" else key): value for key, value in told["set"].items()}
    return Truth(
        **_fields(Truth, about),
        people=tuple(_person(one) for one in told.get("person", {}).values()),
        trials=tuple(_trial(name, one) for name, one in told.get("trial", {}).items()),
        wrong_if=told.get("wrong_if", {}),
    )


def described_truth(folder: Path, limits: Mapping[str, Any]) -> Truth:
    """What the subject.toml or _subject.json beside a recording says, which the laid-out copy lacks.

    Args:
        folder: of the recording.
        limits: of what is nonsense.
    """
    from solver.capture.subject.opened_subject import open_subject  # noqa: PLC0415 (reads descriptions)

    subject = open_subject(folder)
    called_static = sorted(
        path.stem for path in folder.rglob("*static*")
    )  # the description names one of them
    person = PersonTruth(
        None if subject.mass_kg is None else (subject.mass_kg, MASS_WITHIN * subject.mass_kg),
        None if subject.height_m is None else (subject.height_m, MASS_WITHIN * subject.height_m),
        None if subject.static is None else (subject.static.stem, *called_static),
    )
    trials = tuple(TrialTruth(one.name, (one.markers.name,)) for one in subject.trials)
    forces = any(one.forces or _loaded(one.markers) for one in subject.trials)
    return Truth(usable="torques" if forces else "angles", people=(person,), trials=trials, wrong_if=limits)


def _loaded(file: Path) -> bool:
    """Whether a plate of a C3D file ever carries a load; read without this program's code."""
    if file.suffix.lower() != ".c3d":
        return False
    plates = ezc3d.c3d(str(file), extract_forceplat_data=True)["data"]["platform"]
    return any(np.linalg.norm(plate["force"], axis=0).max(initial=0.0) > LOADED_N for plate in plates)


def _person(told: Mapping[str, Any]) -> PersonTruth:
    static = told.get("static")
    named = {} if static is None else {"static": static.split("|")}
    return PersonTruth(**_fields(PersonTruth, {**told, **named}))


def _trial(name: str, told: Mapping[str, Any]) -> TrialTruth:
    plates = {
        int(key.removeprefix("plate")): PlateTruth(**_fields(PlateTruth, one))
        for key, one in told.items()
        if key.startswith("plate") and isinstance(one, dict)
    }
    of_table = tuple((foot, start, end) for _, foot, start, end in told.get("mot_loaded", ()))
    if of_table:
        plates = {0: PlateTruth(0.0, float("inf"), of_table)}
    files = (told.get("markers_file", f"{name}.trc"), *told.get("also", ()))
    return TrialTruth(**_fields(TrialTruth, told) | {"name": name, "files": files, "plates": plates})


def _fields(of: type, told: Mapping[str, Any]) -> dict[str, Any]:
    """What a file says of these fields, lists as tuples."""
    return {field.name: _as_tuples(told[field.name]) for field in fields(of) if field.name in told}


def _as_tuples(value: Any) -> Any:
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value
