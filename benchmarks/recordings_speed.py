"""What recordings and reports cost: CPU time and size of each."""

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from addb_viewer.recordings.mcap_recording import write_mcap
from addb_viewer.recordings.rrd_recording import write_rrd
from addb_viewer.report.content import SubjectReport
from addb_viewer.report.subject_page import write_report
from addb_viewer.trial_view.recording import Recording, recording_of
from solver.capture.capture import Capture, ForcePlate, Markers, Subject, TrialFiles
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.fitting.fit import Fit, KinematicsOnly, TrialFit
from solver.fitting.settings import Settings, as_dict
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.skeleton import Skeleton

FRAMES, MARKERS, RATE = 2000, 60, 100.0
REPEATS = 5
BUDGET, REPORT_BUDGET = "1 s of CPU, 8 MB", "5 MB"


def recordings_speed_table() -> str:
    """One trial of 2000 frames, 60 markers and the default body's 22 segments."""
    fit = synthetic_fit()
    with tempfile.TemporaryDirectory(dir=".") as scratch:  # where recordings would lie, not in memory
        folder = Path(scratch)
        recording = recording_of(fit)
        rows = [
            ("collecting what is to be written", _cpu(lambda: recording_of(fit)), None),
            _row(".rrd", recording, folder / "trial.rrd", write_rrd),
            _row(".mcap", recording, folder / "trial.mcap", write_mcap),
            _report(recording, folder / "report.html"),
        ]
    head = "| | CPU [s] | size [MB] |\n|---|---|---|\n"
    body = "\n".join(
        f"| {what} | {cpu:.2f} | {'' if size is None else f'{size / 1e6:.1f}'} |" for what, cpu, size in rows
    )
    return f"{head}{body}"


def synthetic_fit() -> Fit:
    """A motion of many sines on the default body, two plates, residuals at random."""
    skeleton = _with_markers(default_skeleton(), MARKERS)
    rng = np.random.default_rng(1)
    t = np.arange(FRAMES) / RATE
    speeds = rng.uniform(2, 9, len(skeleton.dofs))
    q = 0.2 * np.sin(np.outer(t, speeds) + rng.uniform(0, 6, len(speeds)))
    model = marker_positions(skeleton, q)
    measured = model + rng.normal(0, 0.008, model.shape)
    for marker in range(0, MARKERS, 3):
        gap = int(rng.integers(0, FRAMES - 60))
        measured[gap : gap + 60, marker] = np.nan
    names = tuple(marker.name for marker in skeleton.markers)
    motion = Motion(skeleton.dofs, q, RATE)
    errors = MarkerErrors(names, np.linalg.norm(measured - model, axis=2))
    wrench = np.zeros((FRAMES, 2, 6))
    wrench[:, :, 1] = 350.0
    counts = np.ones((FRAMES, 2), dtype=bool)
    counts[600:700, 0] = False
    trial = TrialFit(
        capture=Capture("trial", Markers(names, measured, RATE), tuple(_plate(k, rng) for k in range(2))),
        motion=motion,
        marker_errors=errors,
        model_markers_ground=model,
        contacts=ContactWrenches(
            ("calcn_r", "calcn_l"),
            wrench,
            np.zeros((FRAMES, 2, 3)),
            observed=np.ones(FRAMES, dtype=bool),
            in_contact=np.ones((FRAMES, 2), dtype=bool),
            plate=np.tile([0, 1], (FRAMES, 1)),
            wrench_raw_ground=wrench,
        ),
        mask=FrameMask(counts, ((600, 700, "calcn_r", "notOverForcePlate"),), "review"),
        dynamics=Dynamics(
            joint_torques=np.zeros_like(q),
            residual_root=rng.normal(0, 15, (FRAMES, 6)),
            residual_raw_root=np.zeros((FRAMES, 6)),
            com_ground=model.mean(axis=1),
            root_ground=model[:, 0],
            used=counts.all(axis=1),
            motion=motion,
        ),
        kinematics_only=KinematicsOnly(motion, errors),
    )
    folder = Path("trial")
    subject = Subject(folder, (TrialFiles("trial", folder / "trial.trc"),), mass_kg=skeleton.mass)
    return Fit(subject, skeleton, (trial,), skeleton.mass, 1.72, settings=as_dict(Settings()))


def _with_markers(skeleton: Skeleton, count: int) -> Skeleton:
    """The default markers, and copies beside them until there are so many."""
    own = list(skeleton.markers)
    copies = (
        replace(marker, name=f"{marker.name}_{k}", position_body=marker.position_body + 0.02 * k)
        for k in (1, 2)
        for marker in own
    )
    return replace(skeleton, markers=tuple([*own, *copies][:count]))


def _plate(k: int, rng: np.random.Generator) -> ForcePlate:
    force = rng.normal(0, 5, (10 * FRAMES, 3))
    force[:, 1] += 350.0
    cop = rng.normal(0, 0.01, (10 * FRAMES, 3)) * [1, 0, 1]
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0.5], [0, 0, 0.5]]) + np.array([0, 0, 0.6 * k])
    return ForcePlate(f"plate {k + 1}", force, np.cross(cop, force), cop, 10 * RATE, 0.0, corners)


def _row(
    what: str, recording: Recording, file: Path, write: Callable[[Recording, Path], Path]
) -> tuple[str, float, int]:
    return f"`{what}` ({BUDGET} aimed at)", _cpu(lambda: write(recording, file)), file.stat().st_size


def _report(recording: Recording, file: Path) -> tuple[str, float, int]:
    seconds = _cpu(lambda: write_report(SubjectReport(recording), file), 3)
    return f"report ({REPORT_BUDGET} aimed at)", seconds, file.stat().st_size


def _cpu(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median CPU time of all threads [s]."""
    spent = []
    for _ in range(repeats):
        began = time.process_time()
        work()
        spent.append(time.process_time() - began)
    return float(np.median(spent))


if __name__ == "__main__":
    argparse.ArgumentParser(prog="python -m benchmarks.recordings_speed", description=__doc__).parse_args()
    print(recordings_speed_table())
