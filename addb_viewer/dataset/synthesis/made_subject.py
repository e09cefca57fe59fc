"""A synthetic subject: its folder as a laboratory would hand it over, and what is true of it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from addb_viewer.dataset.synthesis.laboratories import Laboratory
from addb_viewer.dataset.synthesis.people import MadeUpPerson
from addb_viewer.dataset.synthesis.recording import FEET, RecordedTrial, truth_of, write_trial
from addb_viewer.dataset.synthesis.reviewing import keep_reviews
from annotations.events import Event
from solver.capture.atomic import write_whole


@dataclass(frozen=True)
class MadeTrial:
    """A trial, what reviewers say of it, and which trap it is."""

    recorded: RecordedTrial
    said: tuple[Event, ...]
    trap: str | None = None
    labelled: bool = False


@dataclass(frozen=True)
class MadeSubject:
    """A folder of a corpus."""

    laboratory: Laboratory
    person_name: str
    folder: str
    person: MadeUpPerson
    mass_entered_kg: float
    static: RecordedTrial
    trials: tuple[MadeTrial, ...]
    faults: tuple[str, ...] = ()
    trap: str | None = None
    consent: str | None = "public"
    licence: str | None = None  # None: the laboratory's
    feet: tuple[str, ...] = FEET

    @property
    def subject_id(self) -> str:
        """As a release calls it."""
        return f"{self.laboratory.source}/{self.folder}"

    @property
    def person_id(self) -> str:
        """Likewise."""
        return f"{self.laboratory.source}/{self.person_name}"

    @property
    def place(self) -> str:
        """Of its folder in the corpus."""
        return f"{self.laboratory.source}/{self.folder}"


def write_subject_folder(root: Path, subject: MadeSubject) -> Path:
    """Recordings, description and reviews; nothing in it tells that, or how, it was made.

    Args:
        root: of the corpus.
        subject: to be written.
    """
    folder = root / subject.place
    folder.mkdir(parents=True, exist_ok=True)
    for trial in (subject.static, *(made.recorded for made in subject.trials)):
        write_trial(folder, trial)
    write_whole(folder / "subject.toml", _description(subject))
    keep_reviews(folder, [(made.recorded.name, event) for made in subject.trials for event in made.said])
    return folder


def write_truth(folder: Path, subject: MadeSubject) -> dict[str, Any]:
    """Arrays of each trial as NAME.npz below the truth's folder; what one file of the corpus says of it.

    Args:
        folder: of the truth.
        subject: whose.
    """
    place = folder / subject.place
    place.mkdir(parents=True, exist_ok=True)
    for made in subject.trials:
        arrays: dict[str, Any] = truth_of(made.recorded)
        np.savez_compressed(place / f"{made.recorded.name}.npz", **arrays)
    return {
        "subject_id": subject.subject_id,
        "person_id": subject.person_id,
        "place": subject.place,
        "sex": subject.person.sex,
        "age_years": subject.person.age_years,
        "height_m": subject.person.height_m,
        "mass_kg": subject.person.mass_kg,
        "mass_entered_kg": subject.mass_entered_kg,
        "segment_masses_kg": _masses(subject),
        "faults": list(subject.faults),
        "trap": subject.trap,
        "trials": [_trial_truth(made) for made in subject.trials],
    }


def _masses(subject: MadeSubject) -> dict[str, float]:
    return {body.name: body.mass for body in subject.static.truth.body.skeleton.bodies}


def _trial_truth(made: MadeTrial) -> dict[str, Any]:
    one = made.recorded
    return {
        "name": one.name,
        "activity": one.activity,
        "activity_sub": one.subclass,
        "speed_m_s": one.truth.scenario.speed,
        "labelled": made.labelled,
        "rate_hz": one.rate,
        "frames": one.capture.markers.frames,
        "trap": made.trap,
    }


def _description(subject: MadeSubject) -> str:
    person = {
        "mass_kg": subject.mass_entered_kg,
        "height_m": subject.person.height_m,
        "sex": subject.person.sex,
        "age_years": subject.person.age_years,
        "foot_bodies": list(subject.feet),
        "static": f"{subject.static.name}.trc",
    }
    laboratory = subject.laboratory
    release = {
        "source": laboratory.source,
        "person": subject.person_name,
        "laboratory": laboratory.source.rsplit(" ", 1)[0],
        "licence": laboratory.licence if subject.licence is None else subject.licence or None,
        "consent": subject.consent,
        "citation": f"{laboratory.source}, made up",
    }
    tables: list[tuple[str | None, Mapping[str, object]]] = [(None, person), ("release", release)]
    for made in subject.trials:
        files = {"markers": f"{made.recorded.name}.trc"}
        if made.recorded.capture.plates:
            files["forces"] = f"{made.recorded.name}.mot"
        tables.append((f"trials.{made.recorded.name}", files))
    return "\n".join(_table(name, values) for name, values in tables)


def _table(name: str | None, values: Mapping[str, object]) -> str:
    lines = [] if name is None else [f"[{name}]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in values.items() if value is not None]
    return "\n".join(lines) + "\n"
