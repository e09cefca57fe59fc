"""Who a C3D file says was recorded: name, mass, height, sex and age, as capture programs write them."""

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from solver.capture.formats.c3d_header import parameters_in
from solver.capture.subject.description import SEXES, Description
from solver.common.notes import Kind, Note, noted

# PROCESSING: Vicon and our own export; SUBJECTS: Vicon, Qualisys, CGM2; the others: older programs.
GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "PATIENT", "ANTHROPOMETRY", "ANTHROPOMETRIC", "MP")
MASS = frozenset({"MASS", "BODYMASS", "WEIGHT", "BODYWEIGHT", "GEWICHT", "KORPERGEWICHT", "POIDS", "MASSE"})
HEIGHT = frozenset({"HEIGHT", "BODYHEIGHT", "STATURE", "GROSSE", "KORPERGROSSE", "TAILLE", "STATURA"})
SEX = frozenset({"SEX", "GENDER", "GESCHLECHT", "SEXE"})
AGE = frozenset({"AGE", "ALTER"})
UNITS = re.compile(r"^A_|(?<=.)_?(KG|MM|CM|M)$|[^A-Z]")  # around a key: A_BodyMass_kg
MASS_KG, HEIGHT_M, AGE_YEARS = (3.0, 300.0), (0.4, 2.6), (0.5, 120.0)  # of people
NOBODY = re.compile(r"|default|(new ?)?subject|patient|person|test|unnamed|unknown|static|plug-?in-?gait")
ALIKE = 0.02  # of a mass or height; people change by more between sessions


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
    if path.suffix.lower() != ".c3d":
        return StatedPerson(frozenset())
    status = path.stat()
    return _stated(path, (status.st_mtime_ns, status.st_size))


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
        if high > low * (1 + ALIKE) and key != "age_years":
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


@lru_cache(maxsize=4096)
def _stated(path: Path, stamp: tuple[int, int]) -> StatedPerson:
    """Read again when the file's time or size has changed."""
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
