"""Part (b): simulated people, whose motion obeys F = ma exactly; wrong masses, moved skin, two models."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.truth.figures import against_truth
from benchmarks.truth.skin import skin_movement
from benchmarks.truth.ways import TimeHistory, all_ways, bench_settings, torques_of
from solver.capture.capture import Capture, Markers
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.simulate.demo_subject import MARKERS, STATIC_MARKERS
from solver.simulate.laboratory import MeasurementSettings, Plate, measure, plates_under, standing_plates
from solver.simulate.other_masses import with_segment_masses
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.simulate.subject_folder import write_subject
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.skeleton import Skeleton

MASS_ERROR = 0.07  # largest, of each segment's mass, left and right alike; the body's mass is right
OWN_MODEL_SKIN_MM = (0.0, 0.1, 0.3, 1.0, 3.0, 5.0, 10.0)
DEFAULT_BODY_SKIN_MM = (0.0, 3.0, 10.0)
PERSONS = 3
FEET = ("calcn_r", "calcn_l")
SCENARIOS = {
    "walk": (Scenario("walk", "walk", duration=2.4), 100.0),
    "run": (Scenario("run", "run", duration=1.6), 100.0),
    "squat": (Scenario("squat", "squat", duration=3.2), 100.0),
    "sprint": (Scenario("sprint", "sprint", duration=1.0), 200.0),
    "landing": (Scenario("landing", "landing", duration=1.0), 200.0),
}  # with the cameras' rate [Hz]
WHO = (
    Person(64.0, 1.68, "female"),
    Person(78.0, 1.80, "male"),
    Person(71.0, 1.74, "female"),
    Person(58.0, 1.62, "female"),
    Person(90.0, 1.86, "male"),
    Person(68.0, 1.76, "male"),
)  # the last three taught the bands, and judge nothing
STEP_PLATE_M = (0.90, 0.60)  # under each step, so that no force is missing


@dataclass(frozen=True)
class Truth:
    """One person in one trial, and the model that there is of the person: right but for its masses."""

    trial: SyntheticTrial
    static: SyntheticTrial
    model: Skeleton


def runs(activity: str, person: int) -> Iterator[dict[str, object]]:
    """Both models, each amount of skin movement."""
    truth = made(activity, person)
    for model, sizes in (("own", OWN_MODEL_SKIN_MM), ("default body", DEFAULT_BODY_SKIN_MM)):
        for size in sizes:
            labels = {"activity": activity, "model": model, "skin_mm": size, "person": person}
            yield _run(labels, truth, own=model == "own", skin_mm=size)


def made(activity: str, person: int) -> Truth:
    """The truth of a case; the same numbers give the same one."""
    scenario, _ = SCENARIOS[activity]
    who = replace(WHO[person], mass_scatter=0.0, com_scatter_m=0.0)
    body_rng, mass_rng, motion_rng, static_rng = np.random.default_rng(500 + person).spawn(4)
    nominal = body_of(who, body_rng)
    body = replace(nominal, skeleton=with_wrong_masses(nominal.skeleton, mass_rng))
    return Truth(
        simulate_trial(scenario, body, motion_rng),
        simulate_trial(Scenario("static", "stand", duration=1.0), body, static_rng),
        nominal.skeleton,
    )


def with_wrong_masses(skeleton: Skeleton, rng: np.random.Generator) -> Skeleton:
    """Segment masses up to `MASS_ERROR` off, inertias with them; left like right, the total as it was."""
    kinds = list(dict.fromkeys(_kind(name) for name in skeleton.body_names))
    drawn = dict(zip(kinds, rng.uniform(-1, 1, len(kinds)), strict=True))
    mass = {k: sum(b.mass for b in skeleton.bodies if _kind(b.name) == k) for k in kinds}
    off = sum(drawn[k] * mass[k] for k in kinds) / skeleton.mass
    errors = {k: drawn[k] - off for k in kinds}
    largest = max(abs(e) for e in errors.values())
    return with_segment_masses(
        skeleton, {name: 1 + MASS_ERROR * errors[_kind(name)] / largest for name in skeleton.body_names}
    )


def true_time_history(trial: SyntheticTrial, rate: float) -> TimeHistory:
    """Exact derivatives, and torques under the exact reactions of the ground."""
    motion = trial.frames(rate)
    q, v, a = trial.motion.state(motion.times)
    time_history = TimeHistory(motion.dofs, rate, q, v, a)
    wrench = trial.reactions(motion.times).wrench_ground
    exact = _WithDerivatives(q, v, a)
    return time_history.with_torque(torques_of(trial.body.skeleton, exact, wrench, FEET))  # type: ignore[arg-type]


@dataclass(frozen=True)
class _WithDerivatives:
    """Looks like a motion whose derivatives are known."""

    q: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def _run(labels: dict[str, object], truth: Truth, *, own: bool, skin_mm: float) -> dict[str, object]:
    activity, settings = str(labels["activity"]), bench_settings()
    _, rate = SCENARIOS[activity]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "subject"
        person = int(labels["person"])  # type: ignore[call-overload]
        fit = solved(truth, activity, person, folder, own=own, skin_mm=skin_mm)
        own_model = load_skeleton(folder / "own.osim") if own else None
        ways = all_ways(fit, fit.trials[0], settings, activity, own_model)
    time_history = true_time_history(truth.trial, rate)
    return against_truth(labels, fit, ways, time_history, truth.trial.body.skeleton)


def solved(truth: Truth, activity: str, person: int, folder: Path, *, own: bool, skin_mm: float) -> Fit:
    """The person recorded, written into a folder and solved."""
    _, rate = SCENARIOS[activity]
    captures = [
        recorded(truth.static, STATIC_MARKERS, 100.0, skin_mm, person),
        recorded(truth.trial, MARKERS, rate, skin_mm, person),
    ]
    write_subject(folder, WHO[person], captures)
    if own:
        write_skeleton(truth.model, folder / "own.osim")
    return solve(open_subject(folder), bench_settings())


def recorded(
    trial: SyntheticTrial, names: tuple[str, ...], rate: float, skin_mm: float, person: int
) -> Capture:
    """Exact cameras but for the skin; plates with the laboratory's own noise."""
    equipment = MeasurementSettings(
        marker_rate=rate, marker_noise_m=0.0, gaps_per_marker_minute=0.0, skin=False
    )
    capture = measure(trial, plates_of(trial), names, equipment, np.random.default_rng(900 + person))
    skeleton = trial.body.skeleton
    times = capture.markers.times
    weight = skeleton.mass * 9.80665
    moved = skin_movement(
        skeleton,
        [skeleton.markers[skeleton.marker_names.index(name)].body for name in names],
        trial.motion.derivative(times, 0),
        times=times,
        load=trial.reactions(times).force_ground[:, :, 1] / weight,
        rng=np.random.default_rng(200 + person),
    )
    if trial.scenario.activity == "stand":
        moved = np.zeros_like(moved)
    shown = Markers(capture.markers.names, capture.markers.positions_ground + skin_mm / 1000 * moved, rate)
    return replace(capture, markers=shown)


def plates_of(trial: SyntheticTrial) -> tuple[Plate, ...]:
    """Under every foot of the trial."""
    if trial.scenario.activity == "stand":
        return ()
    if trial.scenario.activity in ("squat", "landing"):
        return standing_plates(trial.contacts)
    return plates_under(trial.contacts, (0.0, trial.scenario.duration), size=STEP_PLATE_M)


def _kind(body_name: str) -> str:
    return body_name.removesuffix("_r").removesuffix("_l")
