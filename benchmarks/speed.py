"""CPU seconds on one core: inverse kinematics against OpenSim's in the same run; start of the app."""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.opensim_kinematics import opensim_inverse_kinematics
from solver.capture.capture import Markers
from solver.capture.subject.subject import open_subject
from solver.fitting.fit import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.simulate.demo import write_demo_subject
from solver.skeleton.osim_writer import write_skeleton

REPEATS = 5


def inverse_kinematics_speed(title: str, fit: Fit, trial: str) -> str:
    """One line: our frames/s and OpenSim's, same skeleton, same markers."""
    solved = next(t for t in fit.trials if t.capture.name == trial)
    markers = solved.capture.markers
    columns = [markers.names.index(n) for n in solved.marker_errors.names if n in markers.names]
    known = [i for i, n in enumerate(solved.marker_errors.names) if n in markers.names]
    skeleton = fit.skeleton.with_markers([fit.skeleton.markers[i] for i in known])
    observed = markers.positions_ground[:, columns]
    ours = min(_cpu_seconds(lambda: _solve(skeleton, observed, markers.rate)) for _ in range(REPEATS))
    line = (
        f"| {title} | {len(skeleton.dofs)} | {len(known)} | {markers.frames} "
        f"| {markers.frames / ours:.0f} frames/s "
    )
    try:
        with tempfile.TemporaryDirectory() as scratch:
            model = Path(scratch) / "model.osim"
            write_skeleton(skeleton, model)
            named = Markers(skeleton.marker_names, observed, markers.rate, markers.start_time)
            theirs = opensim_inverse_kinematics(model, named).cpu_seconds
    except ImportError:
        return line + "| no OpenSim here | |"
    return line + f"| {markers.frames / theirs:.0f} frames/s | {theirs / ours:.0f} |"


def _solve(skeleton, observed, rate):  # type: ignore[no-untyped-def]
    return inverse_kinematics(skeleton, observed, rate, Settings().kinematics)


def _cpu_seconds(work) -> float:  # type: ignore[no-untyped-def]
    start = time.process_time()
    work()
    return time.process_time() - start


def demo_fit(folder: Path) -> Fit:
    """The synthetic subject on the default body: 37 degrees of freedom, full marker set."""
    write_demo_subject(folder, np.random.default_rng(1))
    return solve(open_subject(folder), Settings())


def speed_table(fits: dict[str, tuple[Fit, str]]) -> str:
    """Inverse kinematics of some trials: title → (fit, trial)."""
    lines = [
        "| trial | dofs | markers | frames | ours | OpenSim InverseKinematicsTool | ratio |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [inverse_kinematics_speed(title, fit, trial) for title, (fit, trial) in fits.items()]
    return "\n".join(lines)


def app_start_seconds(subject: Path) -> float:
    """Wall seconds from the command to the address, printed once the first frame is in the scene."""
    command = [sys.executable, "-m", "addb_viewer", "open", str(subject), "--port", "8931"]
    start = time.perf_counter()
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"COLUMNS": "200"},
    )
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if re.search(r"http://127\.0\.0\.1:\d+", line):
                return time.perf_counter() - start
        raise RuntimeError("the app ended without printing its address")
    finally:
        process.terminate()
        process.wait(timeout=20)
