"""What a subject's own files say about a person: checked values, and paths that stay inside the folder."""

import json
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from solver.capture.capture import PlanItem, ReleaseWords, TrialFiles
from solver.capture.formats.c3d_contents import parameters_in
from solver.common.errors import CaptureError
from solver.common.file_names import lying
from solver.common.notes import Kind, Note, noted
from solver.common.small_files import BrokenFileError, json_content, kept_while_unchanged, toml_tables

SEXES = {
    **dict.fromkeys(("male", "m", "man", "männlich", "mann", "h", "homme", "masculin"), "male"),
    **dict.fromkeys(("female", "f", "w", "woman", "weiblich", "frau", "femme", "féminin"), "female"),
}
LARGEST = {"mass": (500.0, "kg"), "height": (3.0, "m"), "age": (130.0, "years")}
# PROCESSING: Vicon and our own export; SUBJECTS: Vicon, Qualisys, CGM2; the others: older programs.
GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "PATIENT", "ANTHROPOMETRY", "ANTHROPOMETRIC", "MP")
MASS = frozenset({"MASS", "BODYMASS", "WEIGHT", "BODYWEIGHT", "GEWICHT", "KORPERGEWICHT", "POIDS", "MASSE"})
HEIGHT = frozenset({"HEIGHT", "BODYHEIGHT", "STATURE", "GROSSE", "KORPERGROSSE", "TAILLE", "STATURA"})
SEX = frozenset({"SEX", "GENDER", "GESCHLECHT", "SEXE"})
AGE = frozenset({"AGE", "ALTER"})
UNITS = re.compile(r"^A_|(?<=.)_?(KG|MM|CM|M)$|[^A-Z]")  # around a key: A_BodyMass_kg
MASS_KG, HEIGHT_M, AGE_YEARS = (3.0, 300.0), (0.4, 2.6), (0.5, 120.0)  # of people
NOBODY = re.compile(r"|default|(new ?)?subject|patient|person|test|unnamed|unknown|static|plug-?in-?gait")
SAME_BODY_SHARE = 0.02  # of a mass or height; people change by more between sessions


@dataclass(frozen=True)
class Description:
    """What one file says; None where it is silent."""

    mass_kg: float | None = None
    scale_kg: float | None = None
    height_m: float | None = None
    sex: str | None = None
    age_years: float | None = None
    foot_bodies: tuple[str, ...] | None = None
    tags: tuple[str, ...] | None = None
    model: Path | None = None
    model_is: str | None = None  # "scaled", "generic" or None
    static: Path | None = None
    trials: tuple[TrialFiles, ...] | None = None
    ranges: Mapping[str, tuple[tuple[float, float], ...]] | None = None  # [s] by trial, what counts of it
    release: ReleaseWords | None = None
    prefix: str | None = None  # before the person's labels, in files of several people
    plan: tuple[PlanItem, ...] | None = None
    notes: tuple[Note, ...] = ()

    @property
    def counted_kg(self) -> float | None:
        """The person's mass: a scale's word goes before any other."""
        return self.mass_kg if self.scale_kg is None else self.scale_kg

    @property
    def scale_factor(self) -> float | None:
        """As in `Subject`."""
        return None if self.scale_kg is None else self.scale_kg / (self.mass_kg or self.scale_kg)

    def or_else(self, other: "Description") -> "Description":
        """The same, with the other one's word where this one is silent."""
        silent = {
            field.name: getattr(other, field.name)
            for field in fields(self)
            if getattr(self, field.name) is None
        }
        return replace(self, **silent, notes=self.notes + other.notes)


@dataclass(frozen=True)
class Entries:
    """A table of keys and values in a file, which is named in every complaint."""

    path: Path
    values: Mapping[str, Any]
    prefix: str = ""
    awaited: list[Path] | None = None  # gets the files that are named and not there; None: that is an error

    def complaint(self, key: str, wrong: str) -> CaptureError:
        """An error about one key."""
        return CaptureError(
            f"{self.path}: {self.prefix}{key} = {json.dumps(self.values.get(key), default=str)}: {wrong}"
        )

    def number(self, key: str, quantity: str) -> tuple[float | None, tuple[Note, ...]]:
        """A positive number, written as such or in quotes; None where absent or not above zero."""
        value = self.values.get(key)
        if value is None or value == "":
            return None, ()
        largest, unit = LARGEST[quantity]
        try:
            number = float(str(value).strip().replace(",", ".")) if not isinstance(value, bool) else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self.complaint(key, f"not a number. Write the {quantity} in {unit}.")
        if number > largest:
            raise self.complaint(key, f"not a possible {quantity} in {unit}. Write it in {unit}.")
        if number <= 0:
            return None, noted(
                Kind.OTHER,
                f"{self.path.name}: {key} = {number:g} is not a possible {quantity} and counts as unknown",
            )
        return number, ()

    def sex(self) -> tuple[str | None, tuple[Note, ...]]:
        """The sex as "male" or "female", or None."""
        word = str(self.values.get("sex") or "").strip().lower()
        if word in SEXES or word in ("", "unknown", "other"):
            return SEXES.get(word), ()
        return None, noted(Kind.OTHER, f"{self.path.name}: sex = '{word}' counts as unknown")

    def texts(self, key: str) -> tuple[str, ...] | None:
        """A list of texts, or a single one; None where absent."""
        value = self.values.get(key)
        if value is None:
            return None
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list) or not all(isinstance(item, str) and item.strip() for item in listed):
            raise self.complaint(key, "a list of names is needed.")
        return tuple(item.strip() for item in listed)

    def text(self, key: str) -> str | None:
        """One text; None where absent."""
        value = self.values.get(key)
        if value is not None and not isinstance(value, str):
            raise self.complaint(key, "a text in quotes is needed.")
        return value

    def word(self, key: str, choices: tuple[str, ...]) -> str | None:
        """One of several words; None where absent."""
        value = self.values.get(key)
        if value is not None and value not in choices:
            raise self.complaint(key, f"choose one of {', '.join(choices)}.")
        return value

    def file(self, key: str) -> Path | None:
        """A file inside the folder of this one; None where absent."""
        value = self.values.get(key)
        if value is None:
            return None
        if not isinstance(value, str) or not value.strip():
            raise self.complaint(key, "the name of a file is needed.")
        return self._inside(key, value)

    def files(self, key: str) -> tuple[Path, ...]:
        """Files inside the folder of this one."""
        found = (self._inside(key, name) for name in self.texts(key) or ())
        return tuple(path for path in found if path is not None)

    def unknown(self, known: tuple[str, ...]) -> tuple[Note, ...]:
        """A note about keys that mean nothing here, with the nearest that does."""
        strange = []
        for key in self.values:
            if key not in known:
                near = get_close_matches(key, known, n=1)
                strange.append(f"{self.prefix}{key}" + (f" ({near[0]}?)" if near else ""))
        return (
            noted(Kind.OTHER, f"{self.path.name}: unknown keys are ignored: {', '.join(strange)}")
            if strange
            else ()
        )

    def _inside(self, key: str, name: str) -> Path | None:
        folder, parts = self.path.parent, PurePosixPath(name.strip().replace("\\", "/")).parts
        is_beside = parts[:1] == ("..",)  # files of several people lie beside the folders of each
        if is_beside:
            folder, name, parts = folder.parent, name.strip()[len("../") :], parts[1:]
        if PureWindowsPath(name).anchor or PurePosixPath(name).is_absolute() or ".." in parts:
            raise self.complaint(
                key, "leads out of the subject's folder and the one above it. Copy the file into it."
            )
        for path in (lying(folder, name.strip()), lying(folder, "/".join(parts))):
            if os.path.isfile(path):
                return path
        if self.awaited is not None:
            self.awaited.append(path)
            return None
        near_by = sorted(folder.glob("*") if is_beside else folder.rglob("*"))
        files = [str(p.relative_to(folder)) for p in near_by if p.is_file()]
        near = get_close_matches("/".join(parts), files, n=1)
        raise self.complaint(key, "there is no such file." + (f" Is it '{near[0]}'?" if near else ""))


def read_toml(path: Path) -> Entries:
    """The table of a TOML file.

    Raises:
        CaptureError: it cannot be read or parsed.
    """
    return Entries(path, _read(path, toml_tables))


def read_json(path: Path) -> Entries:
    """The object of a JSON file.

    Raises:
        CaptureError: it cannot be read or parsed, or is no object.
    """
    values = _read(path, json_content)
    if not isinstance(values, dict):
        raise CaptureError(f"{path}: an object in braces is needed, found {type(values).__name__}.")
    return Entries(path, values)


def _read(path: Path, content: Callable[[Path], Any]) -> Any:
    try:
        return content(path)
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read ({error.strerror}).") from error
    except BrokenFileError as error:
        raise CaptureError(f"{path}: {error}") from error


@dataclass(frozen=True)
class StatedPerson:
    """What one file says."""

    names: frozenset[str]  # of subjects, without those that mean nobody
    mass_kg: float | None = None
    height_m: float | None = None
    sex: str | None = None
    age_years: float | None = None


def stated_person(path: Path) -> StatedPerson:
    """What a recording says of the person; of other files than C3D nothing."""
    return _stated(path) if path.suffix.lower() == ".c3d" else StatedPerson(frozenset())


def stated_by(paths: Iterable[Path], known: Description) -> Description:
    """What recordings of one person say together; where they contradict each other, nothing and a note.

    Args:
        paths: the recordings.
        known: what was said of the person elsewhere, which stands.
    """
    said = {path: stated_person(path) for path in paths}
    notes: tuple[Note, ...] = ()
    found = Description()
    for key, unit in (("mass_kg", "kg"), ("height_m", "m"), ("age_years", "years")):
        values = {path: value for path, who in said.items() if (value := getattr(who, key)) is not None}
        if not values or getattr(known, key) is not None:
            continue
        quantity = key.partition("_")[0]
        low, high = min(values.values()), max(values.values())
        if high > low * (1 + SAME_BODY_SHARE) and key != "age_years":
            listed = ", ".join(f"{value:.4g} {unit} in {path.name}" for path, value in values.items())
            notes += noted(
                Kind.OTHER,
                f"the files state different values of {quantity}, so none is used: {listed}; write {key} "
                "into a subject.toml",
            )
            continue
        found = replace(found, **{key: low})
        notes += noted(Kind.PERSON, f"{quantity} {low:.4g} {unit}: stated in {next(iter(values)).name}")
    sexes = {who.sex for who in said.values() if who.sex is not None}
    return replace(found, sex=sexes.pop() if len(sexes) == 1 else None, notes=notes)


@kept_while_unchanged(most=4096)
def _stated(path: Path) -> StatedPerson:
    parameters = parameters_in(path, frozenset(GROUPS))
    by_key: dict[str, list[str]] = {}
    for group in GROUPS:
        for name, texts in parameters.items():
            of_group, _, key = name.partition(":")
            if of_group == group and len(texts) == 1:
                by_key.setdefault(UNITS.sub("", key), []).append(texts[0])
    names = [
        name
        for key in ("SUBJECTS:NAMES", "SUBJECT:NAME", "SUBJECTS:NAME")
        for name in parameters.get(key, ())
        if not NOBODY.fullmatch(name.strip().lower())
    ]

    def first(keys: frozenset[str], value_of: Callable[[str], float | None]) -> float | None:
        texts = (text for key in by_key if key in keys for text in by_key[key])
        return next((value for text in texts if (value := value_of(text)) is not None), None)

    sexes = [SEXES[word] for key in SEX & by_key.keys() for t in by_key[key] if (word := t.lower()) in SEXES]
    return StatedPerson(
        frozenset(names),
        mass_kg=first(MASS, lambda text: _number(text, MASS_KG)),
        height_m=first(HEIGHT, _metres),
        sex=sexes[0] if sexes else None,
        age_years=first(AGE, lambda text: _number(text, AGE_YEARS)),
    )


def _number(text: str, limits: tuple[float, float]) -> float | None:
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        return None
    return number if math.isfinite(number) and limits[0] <= number <= limits[1] else None


def _metres(text: str) -> float | None:
    """A height in metres, whether metres, centimetres or millimetres were written."""
    for per_metre in (1.0, 100.0, 1000.0):
        number = _number(text, (HEIGHT_M[0] * per_metre, HEIGHT_M[1] * per_metre))
        if number is not None:
            return number / per_metre
    return None
