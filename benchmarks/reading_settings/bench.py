"""The recordings of the bench as they are read."""

from functools import cache
from typing import NamedTuple

from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from solver.capture.capture import Capture
from solver.capture.subject import open_subject
from solver.capture.trial import read_trial
from solver.settings import Settings


class Recorded(NamedTuple):
    """One trial."""

    person: str
    capture: Capture
    mass_kg: float | None


@cache
def captures() -> tuple[Recorded, ...]:
    """All trials whose activity is known."""
    reading, found = Settings().reading, []
    for folder, activities in ACTIVITY.items():
        subject = open_subject(data_folder() / folder)
        for files in subject.trials:
            if files.name in activities:
                found.append(Recorded(folder, read_trial(files, reading), subject.mass_kg))
    return tuple(found)
