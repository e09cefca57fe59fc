"""Where exported files go, and what they are called."""

import re
from collections.abc import Sequence

from solver.common.file_names import distinct
from solver.fitting.fit_result import Fit


def file_stem(name: str) -> str:
    """A trial's or subject's name with what file systems or OpenSim dislike in it replaced by "_"."""
    return re.sub(r"[^\w.+-]+", "_", name, flags=re.ASCII).lstrip(".") or "trial"


def trial_stems(fit: Fit) -> dict[str, str]:
    """What the files of each trial are called: by its name, and unlike those of any other trial.

    They do not depend on which of the subject's trials are exported.
    """
    names = dict.fromkeys(
        [trial.name for trial in fit.subject.trials] + [trial.capture.name for trial in fit.trials]
    )
    return distinct(list(names), file_stem)


def notes_on_renamed(fit: Fit) -> tuple[str, ...]:
    """For a person: trials whose names would have given two of them the same files, and what they got."""
    stems = trial_stems(fit)
    exported: Sequence[str] = [trial.capture.name for trial in fit.trials]
    return tuple(
        f"trial '{name}' is written as {stems[name]}, because another trial's files are called "
        f"{file_stem(name)} or differ in capitals alone"
        for name in exported
        if stems[name] != file_stem(name)
    )
