"""Learns the weights of suggested activities from motions whose activity is known, by logistic regression.

    python -m benchmarks.activities --learn [--kept FOLDER]

The motions are of simulated people, and of recordings whose activity stands in the description of their
folder ($ADDB_DATA/README.md). Each person and source counts alike.
"""

import argparse
import json
import pickle
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

import solver.gait
from benchmarks.recordings import data_folder
from solver.capture.capture import TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.common.gravity import GRAVITY
from solver.common.progress import silent
from solver.fitting.fit_result import TrialFit
from solver.fitting.model_stage import read_recordings
from solver.fitting.pipeline import fit_markers
from solver.fitting.settings import settings_for
from solver.gait.activity import LEARNT, Activity
from solver.gait.activity_model import FILE, NAMES, Weights, features_of, windows_of
from solver.gait.activity_suggestion import load_of
from solver.gait.body_motion import body_motion
from solver.gait.settings import GAIT
from solver.kinematics.motion import Motion
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import GRID, Scenario, simulate_trial
from solver.simulate.treadmill import belt_under, on_treadmill
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

RIDGE = 0.001  # on weights, of a mean log-likelihood; smaller ones predict left-out sources hardly better
TARGET = Path(solver.gait.__file__).parent / FILE
SIMULATED = "simulated"  # source of synthetic people
FEET = ("calcn_r", "calcn_l")
HEIGHTS_M, MASS_INDICES = (1.50, 1.92), (19.5, 29.0)  # of adults; [kg/m²]
PERSONS = range(6)  # simulated, by their seeds
SLOW_TO_MAKE = {0: ("landing", "sprint")}
WHAT = {
    "walk": Activity.WALKING,
    "run": Activity.RUNNING,
    "sprint": Activity.RUNNING,
    "squat": Activity.SQUAT,
    "stand": Activity.STANDING,
    "landing": Activity.JUMP,
}
ON_BELTS = ("walk", "run")  # as well as over a floor
DURATION_S = {"walk": 4.0, "run": 1.6, "sprint": 0.8, "squat": 4.0, "stand": 4.0, "landing": 1.5}
STATIC = "its static trial"


@dataclass(frozen=True)
class Example:
    """One trial, or frames of it, whose activity is known."""

    source: str  # of persons and laboratory: what counts together
    activity: Activity
    features: Float[np.ndarray, "windows features"]


@dataclass(frozen=True)
class Known:
    """What a description says about a trial, or about a part of it."""

    source: str  # laboratory or publication
    folder: str
    trial: str
    activity: Activity
    seconds: tuple[float, float] | None = None  # from the first frame; None: all of it


W, R, J = Activity.WALKING, Activity.RUNNING, Activity.JUMP
KNOWN = (
    Known("Dembia", "walk_rajagopal2015", "walk", W),
    Known("gait2354", "walk_gait2354_subject01", "walk1", W),
    Known("step width", "walk_treadmill_stepwidth", "example1", W),
    Known("Hamner", "run_treadmill_hamner2013_subject04", "run400", R),
    Known("Dorn", "sprint_overground_dorn2012_JA1_9ms", "run0900cms", R),
    Known(
        "Camargo", "overground_camargo2021_AB06", "levelground_ccw_fast_01_01", Activity.STANDING, (1.2, 4.0)
    ),
    Known("Camargo", "overground_camargo2021_AB06", "levelground_ccw_fast_01_01", W, (5.6, 12.3)),
    Known(
        "Camargo",
        "overground_camargo2021_AB06",
        "levelground_ccw_fast_01_01",
        Activity.STANDING,
        (13.3, 15.3),
    ),
    Known("Falisse", "overground_falisse_AdDB", "Gait_7", W),
    Known("Arnold", "synthetic_arnold2013_subject01", "trial", W),
    Known("Lencioni", "anomalies/tiziana2019_lencioni", "trial", W),
    Known("OpenCap", "opencap_subject4", "walking1", W),
    Known("OpenCap", "opencap_subject4", "walkingTO1", W),
    Known("OpenCap", "opencap_subject4", "squats1", Activity.SQUAT),
    Known("OpenCap", "opencap_subject4", "STS1", Activity.SIT_TO_STAND),
    Known("OpenCap", "opencap_subject4", "DJ1", J, (1.0, 2.68)),
    Known("OpenCap", "opencap_subject6", "walking1", W),
    Known("OpenCap", "opencap_reviewed", "DJ1", J, (0.76, 2.3)),
    Known("Gordon", "exo_apo_gordon", "NE21", W),
    Known("Gordon", "exo_apo_gordon", "ET21", W),
    Known("La Trobe", "c3d_lab_trials/lasem_FAILT01", "Walk01", W),
    Known("La Trobe", "c3d_lab_trials/lasem_FAILT01", "SLDJ06", J, (0.6, 1.63)),
    Known("opensim-core", "c3d_lab_trials/opensim_core", "doubleLegLanding", J, (1.3, 2.5)),
    *(
        Known(source, folder, STATIC, Activity.STANDING)
        for source, folder in (
            ("gait2354", "walk_gait2354_subject01"),
            ("OpenCap", "opencap_subject4"),
            ("OpenCap", "opencap_subject6"),
            ("Gordon", "exo_apo_gordon"),
            ("La Trobe", "c3d_lab_trials/lasem_FAILT01"),
            ("opensim-core", "c3d_lab_trials/opensim_core"),
        )
    ),
)


def example(
    source: str,
    activity: Activity,
    skeleton: Skeleton,
    feet: Sequence[str],
    motion: Motion,
    *,
    load_BW: Float[np.ndarray, " frames"] | None,
    during: tuple[int, int] | None = None,
) -> Example:
    """Features of the windows in which the activity goes on.

    Args:
        source: of the motion.
        activity: that it shows.
        skeleton: that moves.
        feet: bodies.
        motion: of its coordinates.
        load_BW: all plates [body weights].
        during: frames on which it is what it is called; None: all.
    """
    moved = body_motion(skeleton, feet, motion, GAIT, load_BW)
    first, last = during or (0, moved.frames)
    windows = windows_of(moved)
    spans = [s for s, (a, b) in zip(windows.spans, windows.cells, strict=True) if first <= (a + b) / 2 < last]
    return Example(source, activity, np.array([features_of(moved, span) for span in spans]))


def simulated(folder: Path) -> Iterator[Example]:
    """What simulated people do; motions are kept in a folder, since some take a minute to make."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in PERSONS:
        rng = np.random.default_rng(seed)
        height = float(rng.uniform(*HEIGHTS_M))
        mass = float(rng.uniform(*MASS_INDICES)) * height**2
        body = body_of(Person(mass, height, "female" if rng.random() < 0.5 else "male"), rng)
        model = RigidBodyModel(body.skeleton)
        for scenario in _scenarios(seed, rng):
            rate = 200.0 if scenario.activity in GRID else 100.0
            ways = ("floor", "belt") if scenario.activity in ON_BELTS else ("floor",)
            files = [folder / f"{seed}-{scenario.name}-{way}.npy" for way in ways]
            if not all(file.exists() for file in files):
                flat = replace(scenario, heading_deg=0.0) if "belt" in ways else scenario
                trial = simulate_trial(flat, body, np.random.default_rng([seed, len(scenario.name)]))
                np.save(files[0], trial.frames(rate).q)
                if "belt" in ways:
                    assert scenario.speed is not None
                    np.save(files[1], on_treadmill(trial, belt_under(trial, scenario.speed)).frames(rate).q)
            for file in files:
                motion = Motion(body.skeleton.dofs, np.load(file), rate)
                rise = model.centre_of_mass_acceleration(motion.q, motion.velocity, motion.acceleration)[:, 1]
                activity, load = WHAT[scenario.activity], 1 + rise / GRAVITY
                yield example(SIMULATED, activity, body.skeleton, FEET, motion, load_BW=load)


def _scenarios(seed: int, rng: np.random.Generator) -> list[Scenario]:
    speeds = {
        "slow walk": ("walk", float(rng.uniform(0.7, 1.2))),
        "fast walk": ("walk", float(rng.uniform(1.2, 2.0))),
        "run": ("run", float(rng.uniform(2.3, 4.2))),
        "squat": ("squat", None),
        "stand": ("stand", None),
    } | {name: (name, 8.0 if name == "sprint" else None) for name in SLOW_TO_MAKE.get(seed, ())}
    return [
        Scenario(name, activity, DURATION_S[activity], speed, heading_deg=float(rng.uniform(-180, 180)))
        for name, (activity, speed) in speeds.items()
    ]


def recorded(folder: Path) -> Iterator[Example]:
    """All of them, by the motion of their markers; fits are kept in a folder, since they take minutes.

    Args:
        folder: made if it does not exist.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for known in KNOWN:
        file = folder / f"{known.folder.replace('/', '__')}.pickle"
        if not file.exists():
            trials = sorted({k.trial for k in KNOWN if k.folder == known.folder})
            file.write_bytes(pickle.dumps(_tracked(known.folder, trials)))
        skeleton, trial, mass = pickle.loads(file.read_bytes())[known.trial]
        motion, contacts = trial.motion.filled(), trial.contacts
        assert contacts is not None
        during = None
        if known.seconds is not None:
            first, last = (round(second * motion.rate) for second in known.seconds)
            during = first, min(last, motion.frames)
        load = load_of(contacts, mass)
        yield example(
            known.source, known.activity, skeleton, contacts.foot_bodies, motion, load_BW=load, during=during
        )


def _tracked(folder: str, trials: Sequence[str]) -> dict[str, tuple[Skeleton, TrialFit, float]]:
    """The motion of the markers, and loads by foot: suggestions need no more of a fit."""
    subject = open_subject(data_folder() / folder)
    if STATIC in trials:
        assert subject.static is not None
        subject = replace(subject, trials=(*subject.trials, TrialFiles(STATIC, subject.static)))
    settings = settings_for(subject.folder)
    chosen = [files for files in subject.trials if files.name in trials]
    state = read_recordings(subject, chosen, settings)
    state = fit_markers(state, settings, silent)
    mass = subject.mass_kg or state.skeleton.mass
    return {trial.capture.name: (state.skeleton, trial, mass) for trial in state.trials}


def learnt(examples: Sequence[Example]) -> Weights:
    """Weights of the learnt classes. Every class counts alike, and within it every source and trial.

    Args:
        examples: trials whose activity is known; those of other classes are left out.
    """
    known = [one for one in examples if one.activity in LEARNT and len(one.features)]
    x = np.concatenate([one.features for one in known])
    y = np.concatenate([np.full(len(one.features), LEARNT.index(one.activity)) for one in known])
    importance = np.concatenate(
        [np.full(len(one.features), w) for one, w in zip(known, _shares(known), strict=True)]
    )
    importance = importance / np.repeat(
        [len(one.features) for one in known], [len(one.features) for one in known]
    )
    sizes = len(LEARNT), len(NAMES)

    def unlikely(
        parameters: Float[np.ndarray, " parameters"],
    ) -> tuple[float, Float[np.ndarray, " parameters"]]:
        weights, bias = parameters[: -sizes[0]].reshape(sizes), parameters[-sizes[0] :]
        scores = x @ weights.T + bias
        scores -= scores.max(axis=1, keepdims=True)
        log_p = scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
        error = np.exp(log_p)
        error[np.arange(len(y)), y] -= 1
        error *= importance[:, None]
        value = -(importance * log_p[np.arange(len(y)), y]).sum() + RIDGE / 2 * (weights**2).sum()
        return float(value), np.concatenate([(error.T @ x + RIDGE * weights).ravel(), error.sum(axis=0)])

    start = np.zeros(sizes[0] * (sizes[1] + 1))
    found = minimize(unlikely, start, jac=True, method="L-BFGS-B", options={"maxiter": 2000, "gtol": 1e-8})
    return Weights(found.x[: -sizes[0]].reshape(sizes), found.x[-sizes[0] :])


def _shares(examples: Sequence[Example]) -> list[float]:
    """Of the whole, what each trial counts: classes alike, in a class sources, in a source trials."""
    shares = []
    for one in examples:
        of_class = [other for other in examples if other.activity is one.activity]
        of_source = [other for other in of_class if other.source == one.source]
        sources = {other.source for other in of_class}
        classes = {other.activity for other in examples}
        shares.append(1 / len(classes) / len(sources) / len(of_source))
    return shares


def write_weights(weights: Weights, examples: Sequence[Example]) -> None:
    """Put them into the package, with what they were learnt on.

    Args:
        weights: of all examples.
        examples: the examples.
    """
    counted = {a: Counter(one.source for one in examples if one.activity is a) for a in LEARNT}
    told = {
        "made_by": "python -m benchmarks.activities --learn",
        "ridge": RIDGE,
        "examples": {activity: dict(sorted(sources.items())) for activity, sources in counted.items()},
        "classes": {
            activity: {
                "bias": round(float(bias), 4),
                "weights": {name: round(float(w), 4) for name, w in zip(NAMES, row, strict=True)},
            }
            for activity, bias, row in zip(LEARNT, weights.bias, weights.weights, strict=True)
        },
    }
    TARGET.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Make the motions, learn, and put the weights into the solver."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.activities", description=__doc__)
    parser.add_argument("--learn", action="store_true", help="put the weights into the solver")
    parser.add_argument(
        "--kept", type=Path, help="folder in which motions are kept: making them takes minutes"
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.kept or Path(scratch)
        examples = [*simulated(folder / "sim"), *recorded(folder / "rec")]
    if given.learn:
        write_weights(learnt(examples), examples)
    print(Counter((one.activity.value, one.source) for one in examples))


if __name__ == "__main__":
    main()
