"""subject.toml: any layout of files, described by hand; read, and written for a folder that has none."""

import json
import math
import os
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import get_args

from solver.capture.capture import PlanItem, PlateWord, ReleaseWords, Subject, TrialFiles, Wanted
from solver.capture.plates.moment_convention import CONVENTIONS
from solver.capture.subject.description import Description, Entries, read_toml
from solver.common.errors import CaptureError
from solver.common.file_names import readable
from solver.common.notes import Note

KEYS = (
    "mass_kg",
    "scale_kg",
    "height_m",
    "sex",
    "age_years",
    "model",
    "model_is",
    "foot_bodies",
    "static",
    "tags",
    "prefix",
    "trials",
    "release",
    "plan",
)
TRIAL_KEYS = ("markers", "forces", "review", "up", "moments", "plates")
MODEL_WORDS = ("scaled", "generic")
READS = {"person": 1, "plate": -1}
RELEASE_KEYS = ("source", "person", "laboratory", "licence", "consent", "citation", "doi", "url")
CONSENTS = ("public", "restricted", "unknown")
BIBTEX = ".bib"
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_HEAD = """\
# How addb-viewer understood this folder. Correct what is wrong: from now on this file is used, and files
# that it does not name are not. Paths are relative to this folder.
# All keys: docs/reference/inputs.md.
"""
_HEAD_OF_B3D = """\
# What the .b3d file says about the person. Correct what is wrong: values here replace those of the file.
# Its trials are those inside it. All keys: docs/reference/inputs.md.
"""
_ABOUT_PLATES = (
    "",
    "# The sign and the zero level of each plate are found from the recording. To set them yourself:",
    '# [trials.NAME.plates."PLATE"]  # named as in the notes',
    '# reads = "person"  # the force on the person; "plate": the force on the plate, its sign is changed',
    "# zero_N = 0.0  # its vertical force with nobody on it, with the sign as in the file",
)
_ABOUT_RELEASE = (
    "",
    "# For releases (addb-viewer dataset build):",
    "# [release]",
    '# source = "SOURCE"  # publication or collection; person = "P01", laboratory = "…"',
    '# licence = "CC-BY-4.0"  # SPDX identifier or URL',
    '# consent = "public"  # or "restricted", "unknown"',
    '# citation = "cite.bib"  # or a text; doi = "10.1234/abcd", url = "https://…"',
)


def read_subject_toml(
    path: Path, model_words: tuple[str, ...] = MODEL_WORDS, awaited: list[Path] | None = None
) -> Description:
    """Read a subject.toml.

    Args:
        path: of the file.
        model_words: what may be said of the model.
        awaited: gets the files that it names and that are not there; they count as not named. None: such a
            file is an error.

    Raises:
        CaptureError: broken TOML, a value of the wrong kind, or a file that is missing or outside the folder.
    """
    entries = replace(read_toml(path), awaited=awaited)
    mass, mass_notes = entries.number("mass_kg", "mass")
    scale, scale_notes = entries.number("scale_kg", "mass")
    height, height_notes = entries.number("height_m", "height")
    age, age_notes = entries.number("age_years", "age")
    sex, sex_notes = entries.sex()
    trials, trial_notes = _trials(entries)
    release, release_notes = release_words(entries)
    notes = mass_notes + scale_notes + height_notes + age_notes + sex_notes + trial_notes + release_notes
    return Description(
        mass_kg=mass,
        scale_kg=scale,
        height_m=height,
        sex=sex,
        age_years=age,
        foot_bodies=entries.texts("foot_bodies"),
        tags=entries.texts("tags"),
        model=entries.file("model"),
        model_is=entries.word("model_is", model_words),
        static=entries.file("static"),
        trials=trials,
        release=release,
        prefix=entries.text("prefix"),
        plan=_plan(entries),
        notes=notes + entries.unknown(KEYS),
    )


def can_name_a_trial(name: str) -> bool:
    """Whether files can be called after it."""
    return bool(name.strip()) and not name.startswith(".") and "/" not in name and "\\" not in name


def _trials(entries: Entries) -> tuple[tuple[TrialFiles, ...] | None, tuple[Note, ...]]:
    tables = entries.values.get("trials")
    if tables is None:
        return None, ()
    if not isinstance(tables, dict) or not tables:
        raise CaptureError(
            f'{entries.path}: trials are tables of their own: [trials.NAME], then markers = "FILE".'
        )
    trials: list[TrialFiles] = []
    notes: tuple[Note, ...] = ()
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise CaptureError(
                f"{entries.path}: trials.{name} is no table. Write [trials.{name}] above its keys."
            )
        if not can_name_a_trial(name):
            raise CaptureError(
                f"{entries.path}: trial '{name}': results are filed under that name; leave out / and \\."
            )
        trial = replace(entries, values=table, prefix=f"trials.{name}.")
        markers, forces = trial.file("markers"), trial.file("forces")
        if markers is None and "markers" in table and entries.awaited is not None:
            continue
        if markers is None:
            raise CaptureError(f'{entries.path}: trials.{name} has no markers. Add markers = "FILE.trc".')
        trials.append(
            TrialFiles(
                name=name,
                markers=markers,
                forces=forces,
                reviews=trial.files("review"),
                up=trial.word("up", ("x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z")),
                moments=trial.word("moments", CONVENTIONS),
                plates=_plates(trial),
            )
        )
        notes += trial.unknown(TRIAL_KEYS)
    return tuple(trials), notes


def _plates(trial: Entries) -> tuple[PlateWord, ...]:
    """What is said of a trial's force plates."""
    tables = trial.values.get("plates", {})
    if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
        raise trial.complaint("plates", 'plates are tables of their own: [trials.NAME.plates."PLATE"].')
    words = []
    for name, table in tables.items():
        plate = Entries(trial.path, table, f"{trial.prefix}plates.{name}.")
        for key in table:
            if key not in ("reads", "zero_N"):
                raise plate.complaint(key, "a plate has no other keys than reads and zero_N.")
        zero = table.get("zero_N")
        is_number = isinstance(zero, int | float) and not isinstance(zero, bool) and math.isfinite(zero)
        if zero is not None and not is_number:
            raise plate.complaint("zero_N", "a number of newtons is needed, in the file's own sign.")
        reads = plate.word("reads", tuple(READS))
        words.append(PlateWord(name, READS[reads] if reads else None, None if zero is None else float(zero)))
    return tuple(words)


def _plan(entries: Entries) -> tuple[PlanItem, ...] | None:
    """What is to be recorded; unlike other keys, one that means nothing is refused: nobody would count it."""
    table = entries.values.get("plan")
    if table is None:
        return None
    if not isinstance(table, dict):
        raise entries.complaint("plan", "it is a table of its own: [plan], then right_steps = 5.")
    own, known = Entries(entries.path, table, "plan."), get_args(Wanted)
    for key, count in table.items():
        if key not in known:
            raise own.complaint(
                key, f"nothing of that name can be counted; choose one of {', '.join(known)}."
            )
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise own.complaint(key, "a whole number from 1 on is needed.")
    return tuple(PlanItem(key, count) for key, count in table.items())


def release_words(entries: Entries) -> tuple[ReleaseWords | None, tuple[Note, ...]]:
    """What a subject.toml says under [release], and a note about keys that mean nothing there.

    Args:
        entries: the whole file's.

    Raises:
        CaptureError: a value is of the wrong kind, or a BibTeX file is missing or outside the folder.
    """
    table = entries.values.get("release")
    if table is None:
        return None, ()
    if not isinstance(table, dict):
        raise entries.complaint("release", 'it is a table of its own: [release], then source = "…".')
    own = replace(entries, values=table, prefix="release.")
    doi = _text(own, "doi")
    if doi is not None:
        doi = re.sub(r"^(https?://(dx\.)?doi\.org/|doi:\s*)", "", doi)
        if not re.fullmatch(r"10\.\d{4,9}/\S+", doi):
            raise own.complaint("doi", "no DOI. Write it as 10.1234/abcd.")
    url = _text(own, "url")
    if url is not None and not re.fullmatch(r"https?://\S+", url):
        raise own.complaint("url", "no address of the web. Write it with https:// in front.")
    words = ReleaseWords(
        source=_name(own, "source"),
        person=_name(own, "person"),
        laboratory=_text(own, "laboratory"),
        licence=_text(own, "licence"),
        consent=own.word("consent", CONSENTS),
        citation=_citation(own),
        doi=doi,
        url=url,
    )
    return words, own.unknown(RELEASE_KEYS)


def _text(entries: Entries, key: str) -> str | None:
    value = entries.values.get(key)
    if value is None:
        return None
    if not isinstance(value, str) or not value.strip():
        raise entries.complaint(key, "a text in quotes is needed; leave the key out where it is not known.")
    return value.strip()


def _name(entries: Entries, key: str) -> str | None:
    """A text that becomes a part of identifiers."""
    value = _text(entries, key)
    if value is not None and (re.search(r"[/\\\x00-\x1f]", value) or value.startswith(".")):
        raise entries.complaint(
            key, "it becomes a part of names: leave out / and \\, and begin with another sign than a dot."
        )
    return value


def _citation(entries: Entries) -> str | None:
    value = _text(entries, "citation")
    if value is None or not value.lower().endswith(BIBTEX) or "\n" in value:
        return value
    path = entries.file("citation")
    if path is None:
        return None
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise entries.complaint("citation", f"cannot be read as text ({error}).") from error


def described_as_toml(subject: Subject) -> str:
    """The text of a subject.toml that `open_subject` reads as this subject."""
    if subject.recording is not None:
        about = [_HEAD_OF_B3D, *_person(subject), *_model(subject)]
    else:
        about = [_HEAD, *_person(subject), *_files(subject), *_trial_lines(subject)]
    return "\n".join([*about, *_plan_lines(subject), *_release(subject), *_comments(subject)]) + "\n"


def _person(subject: Subject) -> Iterator[str]:
    entered, scale = subject.mass_kg, None
    if subject.mass_kg is not None and subject.scale_factor is not None:
        entered, scale = round(subject.mass_kg / subject.scale_factor, 9), subject.mass_kg
    for key, value, without in (
        ("scale_kg", scale, None),
        ("mass_kg", entered, "70.0  # unknown: estimated from the forces, else the height"),
        ("height_m", subject.height_m, "1.75  # unknown: estimated from the scaled model"),
        ("sex", subject.sex, '"female"'),
        ("age_years", subject.age_years, None),
    ):
        if value is not None:
            yield f"{key} = {json.dumps(value)}"
        elif without is not None:
            yield f"# {key} = {without}"
    yield f"foot_bodies = {json.dumps(list(subject.foot_bodies))}"
    if subject.prefix is not None:
        yield f"prefix = {_quoted(subject.prefix)}  # before this person's labels: PREFIX:LASI"
    if subject.tags:
        yield f"tags = {_quoted(list(subject.tags))}"


def _files(subject: Subject) -> Iterator[str]:
    if subject.model is not None:
        yield f"model = {_path(subject, subject.model)}"
    else:
        yield '# model = "scaled.osim"  # without it: the default full body'
    if subject.static is not None:
        yield f"static = {_path(subject, subject.static)}"
    else:
        yield '# static = "static.trc"  # without it: scaled with the trials'


def _model(subject: Subject) -> Iterator[str]:
    yield '# "scaled": the model in the file as it is; "generic": scaled again; "default": the built-in body'
    word = {"stored": "scaled", None: "default"}.get(subject.model_is, subject.model_is)
    yield f"model_is = {_quoted(word)}"


def _trial_lines(subject: Subject) -> Iterator[str]:
    for trial in subject.trials:
        yield ""
        yield f"[trials.{_key(trial.name)}]"
        yield f"markers = {_path(subject, trial.markers)}"
        yield from _forces(subject, trial)
        if trial.reviews:
            yield f"review = [{', '.join(_path(subject, review) for review in trial.reviews)}]"
        for key in ("up", "moments"):
            if getattr(trial, key) is not None:
                yield f"{key} = {_quoted(getattr(trial, key))}"
        for plate in trial.plates:
            yield f"[trials.{_key(trial.name)}.plates.{_key(plate.name)}]"
            if plate.sign is not None:
                yield f'reads = "{"person" if plate.sign > 0 else "plate"}"'
            if plate.zero_N is not None:
                yield f"zero_N = {plate.zero_N}"
    yield from _ABOUT_PLATES


def _plan_lines(subject: Subject) -> Iterator[str]:
    if subject.plan:
        yield "\n[plan]"
        yield from (f"{item.wanted} = {item.count}" for item in subject.plan)


def _release(subject: Subject) -> Iterator[str]:
    if subject.release is None:
        yield from _ABOUT_RELEASE
        return
    yield "\n[release]"
    for key, value in vars(subject.release).items():
        if value is not None:
            yield f"{key} = {_quoted(value)}"


def _key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _quoted(name)


def _forces(subject: Subject, trial: TrialFiles) -> Iterator[str]:
    if trial.forces is not None:
        yield f"forces = {_path(subject, trial.forces)}"
    elif trial.markers.suffix.lower() == ".c3d":
        yield "# forces: those in the C3D file, if it has any"
    else:
        yield '# forces = "forces.mot"  # none was found'


def _comments(subject: Subject) -> Iterator[str]:
    if subject.notes:
        yield "\n# Notes"
        yield from (f"# - {_line(note)}" for note in subject.notes)
    if subject.unused:
        yield "\n# Not used"
        yield from (f"# - {_line(file.file)}: {_line(file.reason)}" for file in subject.unused)


def _path(subject: Subject, path: Path) -> str:
    return _quoted(readable(Path(os.path.relpath(path, subject.folder)).as_posix()))


def _quoted(value: object) -> str:
    """A string or a list of strings; JSON's are TOML's."""
    return json.dumps(value, ensure_ascii=False)


def _line(text: str) -> str:
    """A comment ends with its line, and holds no other control character."""
    return re.sub(r"[\x00-\x1f\x7f]+", " ", text)
