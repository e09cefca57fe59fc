"""A release of simulated walks and runs whose forces are known, written straight from the schema."""

import json
from functools import cache

import numpy as np

from addb_viewer.benchmark.task import FEET, Example, Measured, Seen
from addb_viewer.dataset.columns import COORDINATE_NAMES
from addb_viewer.dataset.reader import MANIFEST
from addb_viewer.dataset.release_tables import (
    COORDINATES,
    FORMAT_VERSION,
    FRAMES,
    KINEMATICS,
    MARKERS,
    SPLITS,
    SUBJECTS,
    TRIALS,
)
from solver.capture.atomic import write_whole
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.skeleton.forward import body_poses
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.scaling import with_mass
from tests.addb_viewer.dataset.synthetic_release import write

RATE, SECONDS = 100.0, 1.2
GRAVITY = np.array([0.0, -9.80665, 0.0])
NAMES = ("calcn_r", "calcn_l")
NOISE_RAD = 2e-4


@cache
def truth(activity):
    """One person's trial: skeleton, q with derivatives, what acts on each foot and where, torques."""
    rng = np.random.default_rng(4)
    body = body_of(Person(mass_kg=70.0), rng)
    trial = simulate_trial(Scenario(activity, activity, duration=SECONDS), body, rng)
    times = np.arange(round(SECONDS * RATE) + 1) / RATE
    state, there = trial.motion.state(times), trial.reactions(times)
    feet = body_poses(body.skeleton, state[0])[1][:, [body.skeleton.body_index(name) for name in NAMES]]
    wrench = there.wrench_ground
    moment = wrench[..., 3:] - np.cross(feet, wrench[..., :3])
    torque = RigidBodyModel(body.skeleton).inverse_dynamics(
        *state, wrench, [body.skeleton.body_index(name) for name in NAMES]
    )
    return body.skeleton, state, wrench[..., :3], moment, there.cop_ground, feet, torque


def example(activity="walk"):
    """The truth, shown without noise."""
    skeleton, (q, _, _), force, moment, cop, feet, torque = truth(activity)
    frames = len(q)
    loaded = force[..., 1] >= 20
    measured = Measured(
        counts=np.ones(frames, dtype=bool),
        phase=loaded[:, 0] + 2 * loaded[:, 1],
        activity=np.array([activity] * frames, dtype=object),
        mass_kg=skeleton.mass,
        force=force,
        moment=moment,
        foot_ground=feet,
        cop_ground=np.where(loaded[..., None], cop, np.nan),
        com_acceleration=force.sum(axis=1) / skeleton.mass + GRAVITY,
        torque=torque,
    )
    seen = Seen(q, RATE, skeleton, 1.74, NAMES)
    return Example("lab/p", "lab/p", f"lab/p/{activity}", np.arange(frames), seen, measured)


def write_release(folder, persons=6, entered=True):
    """Persons who differ by mass and noise; everybody walks, every second one runs too."""
    subjects, trials, coordinates = [], [], []
    for k in range(persons):
        mass, name = 60.0 + 5 * k, f"lab/p{k}"
        subjects.append(
            {"subject_id": name, "person_id": name, "source": "lab", "height_m": 1.74, "mass_kg": mass}
            | {"mass_entered_kg": mass + 1 if entered else None, "contact_bodies": list(NAMES)}
        )
        rng, frames, motion = np.random.default_rng(k), [], []
        for activity in ("run", "walk") if k % 2 else ("walk",):
            trial = f"{name}/{activity}"
            trials.append({"trial_id": trial, "subject_id": name, "name": activity, "activity": activity})
            own = list(_rows(name, trial, activity, mass, rng))
            frames += [row for row, _ in own]
            motion += [row for _, row in own]
        stem = name.replace("/", "__")
        write(folder, FRAMES, frames, stem)
        write(folder, KINEMATICS, motion, stem)
        write(folder, MARKERS, [], stem)
        (folder / "models").mkdir(exist_ok=True)
        for end, kg in {"osim": mass, **({"unfitted.osim": mass + 1} if entered else {})}.items():
            text = skeleton_text(with_mass(truth("walk")[0], kg))
            write_whole(folder / f"models/{stem}.{end}", text)
    for table, rows in ((SUBJECTS, subjects), (TRIALS, trials), (COORDINATES, coordinates)):
        write(folder, table, rows)
    (folder / "splits").mkdir()
    parts = ["train"] * (persons - 4) + ["dev"] + ["test"] * 3
    split = [{"person_id": s["person_id"], "split": part} for s, part in zip(subjects, parts, strict=True)]
    write(folder, SPLITS, split)
    (folder / "splits" / "*.parquet").rename(folder / "splits" / "default.parquet")
    totals = {"subjects": persons, "trials": len(trials), "frames": 0}
    manifest = {"format_version": FORMAT_VERSION, "name": "made up", "version": "1.0.0", "rate_hz": RATE}
    (folder / MANIFEST).write_text(json.dumps(manifest | {"totals": totals}))
    return folder


def _rows(subject, trial, activity, mass, rng):
    skeleton, (q, _, _), force, moment, cop, feet, torque = truth(activity)
    factor = mass / skeleton.mass
    noisy = q + NOISE_RAD * rng.standard_normal(q.shape)
    com = force.sum(axis=1) / skeleton.mass + GRAVITY
    loaded = force[..., 1] >= 20
    for t in range(len(q)):
        keys = {"subject_id": subject, "trial_id": trial, "segment": 0, "frame": t, "time_s": t / RATE}
        row = keys | {"activity": activity, "counts": True, "phase": int(loaded[t, 0] + 2 * loaded[t, 1])}
        row |= {f"tau_{n}": factor * torque[t, d] for d, n in enumerate(skeleton.dofs)}
        for i, axis in enumerate("xyz"):
            row[f"com_a_{axis}_m_s2"] = com[t, i]
            for k, side in enumerate(FEET):
                row[f"grf_{side}_{axis}_N"] = factor * force[t, k, i]
                row[f"grm_{side}_{axis}_Nm"] = factor * moment[t, k, i]
                row[f"foot_{side}_{axis}_m"] = feet[t, k, i]
                row[f"cop_{side}_{axis}_m"] = cop[t, k, i] if loaded[t, k] else None
        assert set(skeleton.dofs) <= set(COORDINATE_NAMES)
        yield row, keys | {f"q_{n}": noisy[t, d] for d, n in enumerate(skeleton.dofs)}
