"""Part (a): the synthetic walk that others made (Arnold 2013's subject01), exact markers and moved skin."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from benchmarks.recordings import data_folder
from benchmarks.truth.figures import against_truth, figures
from benchmarks.truth.skin import skin_movement
from benchmarks.truth.ways import TimeHistory, all_ways, bench_settings, time_history_of, torques_of
from solver.capture.capture import Capture, Subject
from solver.capture.formats.storage import read_storage
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.fitting.pipeline import solve
from solver.kinematics.marker_matching import match_markers
from solver.kinematics.motion import Motion
from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Skeleton

FOLDER = "synthetic_arnold2013_subject01"
SKIN_MM = (0.0, 0.1, 0.3, 1.0, 3.0, 5.0, 10.0)
SKINS = 3  # draws of the skin


def runs() -> Iterator[dict[str, object]]:
    """Each amount of skin movement, for each skin."""
    subject, capture, model = recording()
    truth, settings = true_time_history(model, capture), bench_settings()
    for person in range(SKINS):
        moved = skin(model, capture, truth, person)
        for size in SKIN_MM if person == 0 else SKIN_MM[1:]:
            shown = replace(capture.markers, positions_ground=_positions(capture) + size / 1000 * moved)
            fit = solve(subject, settings, captures={capture.name: replace(capture, markers=shown)})
            ways = all_ways(fit, fit.trials[0], settings, "walk", model)
            labels = {"activity": "walk", "model": "own", "skin_mm": size, "person": person}
            yield against_truth(labels, fit, ways, truth, model)


@cache
def recording() -> tuple[Subject, Capture, Skeleton]:
    """The subject, its trial and the model that made it."""
    subject = open_subject(data_folder() / FOLDER)
    assert subject.model is not None
    return subject, read_trial(subject.trials[0], bench_settings().reading), load_skeleton(subject.model)


def true_time_history(model: Skeleton, capture: Capture) -> TimeHistory:
    """Coordinates from coordinates.sto, torques from OpenSim's own inverse dynamics in id.sto."""
    folder = data_folder() / FOLDER
    motion = true_motion(model, capture)
    forces = read_storage(folder / "id.sto")
    columns = [next(x for x in forces.labels if x in (f"{d}_moment", f"{d}_force")) for d in model.dofs]
    torque = np.stack([forces.column(label) for label in columns], axis=1)
    return time_history_of(motion, torque)


def true_motion(model: Skeleton, capture: Capture) -> Motion:
    """The true coordinates on the markers' frames."""
    table = read_storage(data_folder() / FOLDER / "coordinates.sto")
    if not np.allclose(table.times, capture.markers.times, atol=1e-4):
        raise ValueError(f"{table.path}: not on the markers' frames")
    q = np.stack([table.column(d) for d in model.dofs], axis=1)
    return Motion(model.dofs, q, capture.markers.rate, capture.markers.start_time)


def referee() -> dict[str, dict[str, float | None]]:
    """Our inverse dynamics on the true motion under the recorded forces, against OpenSim's in id.sto."""
    _, capture, model = recording()
    truth = true_time_history(model, capture)
    wrench = np.stack(
        [np.concatenate([p.force_ground, p.moment_ground], axis=1) for p in capture.plates], axis=1
    )
    ours = torques_of(model, true_motion(model, capture), wrench, ("calcn_r", "calcn_l"))
    everywhere = np.ones(len(ours), dtype=bool)
    return figures(truth.with_torque(ours), truth, everywhere)["torque"]


def skin(model: Skeleton, capture: Capture, truth: TimeHistory, person: int) -> np.ndarray:
    """Movement of root mean square 1 of the recorded markers; zero for those that the model does not know."""
    match = match_markers(model, [capture.markers])
    bodies = {m.name: m.body for m in model.markers}
    load = np.stack([p.force_ground[:, 1] for p in capture.plates], axis=1) / (model.mass * 9.80665)
    moved = skin_movement(
        model,
        [bodies[name] for name in match.model],
        truth.angle,
        times=capture.markers.times,
        load=load,
        rng=np.random.default_rng(100 + person),
    )
    everything = np.zeros_like(_positions(capture))
    everything[:, [c for c in match.columns(capture.markers) if c is not None]] = moved
    return everything


def _positions(capture: Capture) -> np.ndarray:
    return capture.markers.positions_ground
