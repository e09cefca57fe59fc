"""A synthetic capture as an ordinary subject folder: nothing in it tells that, or how, it was made."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solver.capture.atomic import write_whole
from solver.capture.capture import Capture, ForcePlate
from solver.capture.formats.storage import write_storage
from solver.capture.formats.trc import write_trc
from solver.simulate.person import Person
from solver.skeleton.forward import cross


def write_subject(folder: Path, person: Person, captures: Sequence[Capture]) -> None:
    """Write `_subject.json` and `trials/NAME/markers.trc` with, where there are plates, `grf.mot`.

    Args:
        folder: made if it doesn't exist.
        person: what the laboratory wrote down: mass, stature, sex.
        captures: the trials.

    Raises:
        CaptureError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    entries = {
        "massKg": person.mass_kg,
        "heightM": person.height_m,
        "sex": person.sex or "unknown",
        "footBodyNames": ["calcn_r", "calcn_l"],
    }
    write_whole(folder / "_subject.json", json.dumps(entries, indent=2) + "\n")
    for capture in captures:
        trial = folder / "trials" / capture.name
        trial.mkdir(parents=True, exist_ok=True)
        write_trc(trial / "markers.trc", capture.markers)
        if capture.plates:
            write_forces(trial / "grf.mot", capture.plates)


def write_forces(path: Path, plates: Sequence[ForcePlate]) -> None:
    """Write plates of one rate as OpenSim names them: force, centre of pressure, moment about that point.

    Args:
        path: of the .mot file.
        plates: their names are the column prefixes, `ground_force_1` and so on.
    """
    labels, columns = [], []
    for plate in plates:
        cop = np.nan_to_num(plate.cop_ground)
        free_moment = plate.moment_ground - cross(cop, plate.force_ground)
        number = plate.name.rsplit("_", 1)[-1]
        labels += [f"{plate.name}_{kind}{axis}" for kind in "vp" for axis in "xyz"]
        labels += [f"ground_torque_{number}_{axis}" for axis in "xyz"]
        columns += [plate.force_ground, cop, free_moment]
    values = np.concatenate(columns, axis=1)
    write_storage(path, labels, plates[0].times, values)
