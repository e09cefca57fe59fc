"""A long synthetic walk on a treadmill with a plate under each belt: every force is measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from solver.capture.capture import Capture, ForcePlate
from solver.simulate.demo import MARKERS
from solver.simulate.laboratory import MeasurementSettings, Plate, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.subject_folder import write_subject
from solver.simulate.trial import Scenario, simulate_trial

SPEED = 1.3  # [m/s] of the belts
EQUIPMENT = MeasurementSettings(force_rate=500.0)  # the filter passes 30 Hz
BELT = Plate((0.0, 0.0), half_length=1.0, half_width=0.25)
SIDEWAYS = np.array([0.0, 0.0, BELT.half_width])  # of the right belt's middle [m]


def write_long_walk(folder: Path, duration: float, rng: np.random.Generator) -> None:
    """Make the subject's folder: `duration` seconds of walking in one trial."""
    who = Person(sex="female")
    body_rng, motion_rng, noise_rng = rng.spawn(3)
    trial = simulate_trial(
        Scenario("long_walk", "walk", duration=duration, speed=SPEED), body_of(who, body_rng), motion_rng
    )
    plates = plates_under(trial.contacts, (0.0, duration))
    overground = measure(trial, plates, MARKERS, EQUIPMENT, noise_rng)
    write_subject(folder, who, [_on_belts(overground)])


def _on_belts(overground: Capture) -> Capture:
    """The same walk seen by somebody who goes along at the belts' speed; F = ma stays as it is."""
    markers = overground.markers
    middle = np.nanmean(markers.positions_ground[0, :, 0])
    carried = np.zeros((markers.frames, 1, 3))
    carried[:, 0, 0] = middle + SPEED * np.arange(markers.frames) / markers.rate
    sides = [np.sign(plate.corners_ground[:, 2].mean()) for plate in overground.plates]
    belts = [
        _belt(
            name,
            [p for p, s in zip(overground.plates, sides, strict=True) if s == side],
            side * SIDEWAYS,
            middle,
        )
        for name, side in (("ground_force_1", 1.0), ("ground_force_2", -1.0))
    ]
    seen = replace(markers, positions_ground=markers.positions_ground - carried)
    return replace(overground, markers=seen, plates=tuple(belts))


def _belt(name: str, plates: list[ForcePlate], centre: np.ndarray, middle: float) -> ForcePlate:
    force = np.sum([p.force_ground for p in plates], axis=0)
    moment = np.sum([p.moment_ground for p in plates], axis=0)
    carried = np.zeros_like(force)
    carried[:, 0] = middle + SPEED * np.arange(len(force)) / EQUIPMENT.force_rate
    moment = moment - np.cross(carried, force)
    vertical = np.where(force[:, 1] > 0, force[:, 1], np.nan)
    cop = np.stack([moment[:, 2], 0 * vertical, -moment[:, 0]], axis=1) / vertical[:, None]
    return ForcePlate(
        name=name,
        force_ground=force,
        moment_ground=moment,
        cop_ground=cop,
        rate=EQUIPMENT.force_rate,
        corners_ground=BELT.corners_ground + centre,
    )
