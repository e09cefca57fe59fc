"""What stages cost, for RESULTS.md: inverse kinematics, re-solves, the review log, recordings and reports."""

import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from addb_viewer.recordings.mcap_recording import write_mcap
from addb_viewer.recordings.rrd_recording import write_rrd
from addb_viewer.report.content import SubjectReport
from addb_viewer.report.subject_page import write_report
from addb_viewer.trial_view.recorded_subject import recording_of
from annotations.events import (
    AcceptProposal,
    ClearRange,
    Event,
    FlagRange,
    Proposal,
    RejectProposal,
    SetActivity,
)
from annotations.folding import folded
from annotations.live_review import LiveReview
from annotations.log import ReviewLog
from annotations.reasons import REASON_KEYS
from benchmarks.markdown import table
from benchmarks.opensim_reference import opensim_inverse_kinematics
from benchmarks.recordings import data_folder
from benchmarks.speed.command_costs import write_repeated_walk
from benchmarks.speed.measuring import cpu_seconds, peak_megabytes, running
from solver.capture.capture import Capture, ForcePlate, Markers, Subject, TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.common.progress import silent
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.fitting.fit_result import Fit, KinematicsOnly, TrialFit
from solver.fitting.held_out_stage import predict_held_out
from solver.fitting.pipeline import fit_to_forces, resolve, solve
from solver.fitting.settings import Settings, as_dict, settings_for
from solver.fitting.state import FitState
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.simulate.demo_subject import write_demo_subject
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

REPEATS = 5
EDIT_S = 0.4  # half a stance of one foot is flagged
LONG = (1000, 10_000)  # frames of the long walks
LOGGED, EDITS, APPENDED = 10_000, 500, 60  # frames of the trial, edits that are there, and timed
TRIAL = "walk"
FEET = ("calcn_r", "calcn_l")
PEOPLE = ("anna", "ben", "cleo")
FRAMES, MARKERS, RATE = 2000, 60, 100.0  # of what is recorded and reported
BUDGET, REPORT_BUDGET = "1 s of CPU, 8 MB", "5 MB"


def demo_fit(folder: Path) -> Fit:
    """The synthetic subject on the default body: 37 degrees of freedom, full marker set."""
    write_demo_subject(folder, np.random.default_rng(1))
    return solve(open_subject(folder), Settings())


def kinematics_table(fits: dict[str, tuple[Fit, str]]) -> str:
    """Inverse kinematics of some trials beside OpenSim's: title → (fit, trial)."""
    head = ["trial", "dofs", "markers", "frames", "ours", "OpenSim InverseKinematicsTool", "ratio"]
    return table(head, [_kinematics_row(title, fit, trial) for title, (fit, trial) in fits.items()])


def _kinematics_row(title: str, fit: Fit, trial: str) -> list[object]:
    """Our frames/s and OpenSim's, same skeleton, same markers."""
    solved = next(t for t in fit.trials if t.capture.name == trial)
    markers = solved.capture.markers
    columns = [markers.names.index(n) for n in solved.marker_errors.names if n in markers.names]
    known = [i for i, n in enumerate(solved.marker_errors.names) if n in markers.names]
    skeleton = fit.skeleton.with_markers([fit.skeleton.markers[i] for i in known])
    observed = markers.positions_ground[:, columns]
    settings = Settings().kinematics
    _, ours = cpu_seconds(lambda: inverse_kinematics(skeleton, observed, markers.rate, settings), REPEATS)
    row = [title, len(skeleton.dofs), len(known), markers.frames, f"{markers.frames / ours:.0f} frames/s"]
    try:
        with tempfile.TemporaryDirectory() as scratch:
            model = Path(scratch) / "model.osim"
            write_skeleton(skeleton, model)
            named = Markers(skeleton.marker_names, observed, markers.rate, markers.start_time)
            theirs = opensim_inverse_kinematics(model, named).cpu_seconds
    except ImportError:
        return [*row, "no OpenSim here", ""]
    return [*row, f"{markers.frames / theirs:.0f} frames/s", f"{theirs / ours:.0f}"]


def app_start_seconds(subject: Path) -> float:
    """Wall seconds from the command to the address, printed once the first frame is in the scene."""
    began = time.perf_counter()
    with running("addb_viewer", "open", str(subject), "--port", "0") as (process, first):
        assert process.stdout is not None
        if "http://" in first or any("http://" in line for line in process.stdout):
            return time.perf_counter() - began
    raise RuntimeError("the app ended without printing its address")


@dataclass(frozen=True)
class Figures:
    """Of one subject with one trial; CPU seconds on one core."""

    frames: int
    dofs: int
    solve_s: float
    fit_s: float
    first_flag_s: float
    flag_s: float
    unflag_s: float
    held_out_s: float
    peak_memory_MB: float


def figures_of(folder: Path, repeats: int) -> Figures:
    """Solve, fit again by itself, flag two half stances one after the other, and take the second back."""
    subject, settings = open_subject(folder), settings_for(folder)
    name = subject.trials[0].name
    solved, solve_s = cpu_seconds(lambda: solve(subject, settings, trials=[name]))
    (trial,) = solved.trials
    later, earlier = _edits(trial)
    one, two = ({name: ForceReview(by_people=edits)} for edits in ((later,), (later, earlier)))
    first, first_flag_s = cpu_seconds(lambda: resolve(solved, one, settings), repeats)
    flagged, flag_s = cpu_seconds(lambda: resolve(first, two, settings), repeats)
    _, unflag_s = cpu_seconds(lambda: resolve(flagged, one, settings), repeats)
    _, held_out_s = cpu_seconds(lambda: predict_held_out(flagged, settings, silent))
    _, fit_s = cpu_seconds(lambda: _trajectory_fit(solved, settings), repeats)
    return Figures(
        frames=trial.motion.frames,
        dofs=len(solved.skeleton.dofs),
        solve_s=solve_s,
        fit_s=fit_s,
        first_flag_s=first_flag_s,
        flag_s=flag_s,
        unflag_s=unflag_s,
        held_out_s=held_out_s,
        peak_memory_MB=peak_megabytes(),
    )


def dynamics_section() -> str:
    """The trajectory fit and the re-solve of a real walk, and how both grow with the trial's length."""
    real = _in_new_process(data_folder() / "walk_rajagopal2015", 3)
    with tempfile.TemporaryDirectory() as scratch:
        folders = [Path(scratch) / f"{frames}" for frames in LONG]
        for folder, frames in zip(folders, LONG, strict=True):
            write_repeated_walk(folder, frames)
        short, long = (_in_new_process(folder, 1) for folder in folders)
    head = [
        "trial",
        "frames",
        "dofs",
        "trajectory fit",
        "solve",
        "first flag",
        "next flag",
        "flag taken back",
    ]
    named = (("walk_rajagopal2015", real), ("long walk, 10 s", short), ("long walk, 100 s", long))
    rows = [_dynamics_row(title, figures) for title, figures in named]
    ratio, fit_ratio = long.solve_s / short.solve_s, long.fit_s / short.fit_s
    return (
        f"{table([*head, 'its held-out blocks', 'peak memory'], rows)}\n\n"
        f"From {short.frames} to {long.frames} frames the whole solve takes {ratio:.1f} times as long, the "
        f"trajectory fit {fit_ratio:.1f} times."
    )


def _dynamics_row(title: str, figures: Figures) -> Sequence[object]:
    per_1000 = 1000 / figures.frames
    edits = (figures.first_flag_s, figures.flag_s, figures.unflag_s, figures.held_out_s)
    return (
        title,
        figures.frames,
        figures.dofs,
        f"{figures.fit_s:.2f} s, {figures.frames / figures.fit_s:.0f} frames/s",
        f"{figures.solve_s:.1f} s",
        *(f"{per_1000 * seconds:.2f} s per 1000 frames" for seconds in edits),
        f"{figures.peak_memory_MB:.0f} MB",
    )


def _in_new_process(folder: Path, repeats: int) -> Figures:
    """Alone, so that the peak of memory is its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(figures_of, folder, repeats).result()


def _edits(trial: TrialFit) -> tuple[ForceLabel, ForceLabel]:
    """Half a stance of the first foot at two thirds of the frames used, and at one third."""
    assert trial.dynamics is not None
    assert trial.contacts is not None
    used, foot = np.flatnonzero(trial.dynamics.used), trial.contacts.foot_bodies[0]
    length = round(EDIT_S * trial.motion.rate)
    later, earlier = (int(used[share * len(used) // 3]) for share in (2, 1))
    ends = [min(start + length, trial.motion.frames) for start in (later, earlier)]
    return (
        ForceLabel(later, ends[0], foot, "manualReview"),
        ForceLabel(earlier, ends[1], foot, "manualReview"),
    )


def _trajectory_fit(fit: Fit, settings: Settings) -> None:
    """The stage alone, from the markers' motion."""
    assert fit.groundwork is not None
    assert fit.groundwork.mass_kg is not None
    begun = [
        replace(
            trial,
            motion=trial.kinematics_only.motion,
            marker_errors=trial.kinematics_only.marker_errors,
            kinematics_only=None,
            spline=None,
        )
        for trial in fit.trials
        if trial.kinematics_only is not None
    ]
    skeleton = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg)
    groundwork = replace(fit.groundwork, phi=None)
    state = FitState(fit.subject, groundwork, skeleton, trials=tuple(begun))
    fit_to_forces(state, settings, silent)


def log_table() -> str:
    """Medians of what is done to a review log, wall time and CPU time."""
    with tempfile.TemporaryDirectory(dir=".") as scratch:  # where recordings would lie, not in memory
        times = _log_times(Path(scratch) / "annotations.sqlite")
    return table(["wall (95th percentile) / CPU [ms]", "SQLite"], list(times.items()))


def _log_times(place: Path) -> dict[str, str]:
    """Times by what was done, on a log that has the edits already."""
    rng = np.random.default_rng(0)
    with ExitStack() as stack:
        log = stack.enter_context(ReviewLog.open(place))
        other = stack.enter_context(ReviewLog.open(place))
        for k in range(EDITS):
            log.append(TRIAL, _event(rng), PEOPLE[k % len(PEOPLE)])
        edits = log.history(TRIAL)
        live = LiveReview(log, FEET)

        def append_and_show() -> None:
            log.append(TRIAL, _event(rng), "anna")
            live.refresh()
            live.review(TRIAL)

        return {
            "append an edit": _wall_and_cpu(lambda: log.append(TRIAL, _event(rng), "anna")),
            "undo, then redo it": _wall_and_cpu(lambda: (log.undo(TRIAL, "anna"), log.redo(TRIAL, "anna"))),
            f"fold {EDITS} edits": _wall_and_cpu(lambda: folded(TRIAL, edits, FEET)),
            "append, and fold all again for the screen": _wall_and_cpu(append_and_show),
            "look for others' edits, none there": _wall_and_cpu(live.refresh),
            "look for others' edits, one there": _wall_and_cpu(
                live.refresh, lambda: other.append("run", _event(rng), "ben")
            ),
            f"read and fold {EDITS} edits from the disk": _wall_and_cpu(lambda: log.review(TRIAL, FEET)),
        }


def _event(rng: np.random.Generator) -> Event:
    start = int(rng.integers(LOGGED - 1))
    end = min(LOGGED, start + 1 + int(rng.integers(400)))
    foot = (None, *FEET)[rng.integers(3)]
    reason = REASON_KEYS[rng.integers(len(REASON_KEYS))].reason
    proposal = Proposal(start, end, reason, foot, 0.8, {"missing_N": 120.5})
    return (
        FlagRange(start, end, reason, foot, "on the edge"),
        ClearRange(start, end, foot),
        AcceptProposal(proposal),
        RejectProposal(proposal),
        SetActivity(start, end, "walk", "overground"),
    )[rng.integers(5)]


def _wall_and_cpu(work: Callable[[], object], before: Callable[[], object] = lambda: None) -> str:
    """Median of the wall time, its 95th percentile, and the median of the CPU time [ms]."""
    wall, cpu = [], []
    for _ in range(APPENDED):
        before()
        start = time.perf_counter(), time.process_time()
        work()
        wall.append(1e3 * (time.perf_counter() - start[0]))
        cpu.append(1e3 * (time.process_time() - start[1]))
    return f"{np.median(wall):.1f} ({np.percentile(wall, 95):.1f}) / {np.median(cpu):.1f}"


def recordings_table() -> str:
    """CPU and size of one trial of 2000 frames, 60 markers and the default body's 22 segments."""
    fit = synthetic_fit()
    recording = recording_of(fit)
    with tempfile.TemporaryDirectory(dir=".") as scratch:  # where recordings would lie, not in memory
        rows: list[list[object]] = [["collecting what is to be written", _cpu(lambda: recording_of(fit)), ""]]
        for what, name, write in (
            (f"`.rrd` ({BUDGET} aimed at)", "trial.rrd", lambda file: write_rrd(recording, file)),
            (f"`.mcap` ({BUDGET} aimed at)", "trial.mcap", lambda file: write_mcap(recording, file)),
            (
                f"report ({REPORT_BUDGET} aimed at)",
                "report.html",
                lambda file: write_report(SubjectReport(recording), file),
            ),
        ):
            file = Path(scratch) / name
            rows.append(
                [what, _cpu(lambda write=write, file=file: write(file)), f"{file.stat().st_size / 1e6:.1f}"]
            )
    return table(["", "CPU [s]", "size [MB]"], rows)


def _cpu(work: Callable[[], object]) -> str:
    return f"{cpu_seconds(work, REPEATS)[1]:.2f}"


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
