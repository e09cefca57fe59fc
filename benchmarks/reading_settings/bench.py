"""The recordings of the bench as they are read."""

from functools import cache

from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from solver.capture.capture import Capture
from solver.capture.subject import open_subject
from solver.capture.trial import read_trial
from solver.settings import Settings


@cache
def captures() -> tuple[tuple[Capture, float | None], ...]:
    """All trials whose activity is known, and the person's mass."""
    reading, found = Settings().reading, []
    for folder, activities in ACTIVITY.items():
        subject = open_subject(data_folder() / folder)
        for files in subject.trials:
            if files.name in activities:
                found.append((read_trial(files, reading), subject.mass_kg))
    return tuple(found)
