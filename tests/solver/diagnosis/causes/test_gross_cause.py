"""Other causes beyond a gross one: what was recorded late, and in each other's columns."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.exchanged_forces import PlateSwap
from solver.diagnosis.causes.gross_cause import Beyond, correct_scene
from solver.diagnosis.causes.plate_readings import PlateGain

LATE_SAMPLES = 12
SWAP = PlateSwap("plate_2+plate_3")


def late(plate):
    def held(values):
        return np.concatenate([np.repeat(values[:1], LATE_SAMPLES, axis=0), values[:-LATE_SAMPLES]])

    point = None if plate.point_ground is None else held(plate.point_ground)
    return replace(
        plate,
        force_ground=held(plate.force_ground),
        moment_ground=held(plate.moment_ground),
        cop_ground=held(plate.cop_ground),
        point_ground=point,
    )


def exchanged(a, b):
    """Each plate's own centre of pressure, the other's force and free moment; loaded where the other is."""
    rows = []
    for own, other in ((a, b), (b, a)):
        carrying = np.isfinite(other.cop_ground).all(axis=1)
        order = np.arange(own.samples)
        written = np.isfinite(own.cop_ground).all(axis=1)
        point = np.stack([np.interp(order, order[written], c[written]) for c in own.cop_ground.T], axis=1)
        free = other.moment_ground - np.cross(np.nan_to_num(other.cop_ground), other.force_ground)
        moment = np.where(carrying[:, None], free + np.cross(point, other.force_ground), 0.0)
        cop = np.where(carrying[:, None], point, np.nan)
        rows.append(replace(own, force_ground=other.force_ground, moment_ground=moment, cop_ground=cop))
    return rows


@pytest.fixture(scope="module")
def late_and_exchanged(crisp, seen):
    plates = [late(p) for p in crisp.plates]
    plates[1:3] = exchanged(plates[1], plates[2])
    for k in (1, 2):
        plates[k] = replace(plates[k], point_ground=late(crisp.plates[k]).cop_ground)
    return seen(replace(crisp, plates=tuple(plates)))


def test_both_together_give_the_true_wrench(crisp, seen, late_and_exchanged):
    scene, true = late_and_exchanged, seen(crisp).measured_ground
    offset_s = LATE_SAMPLES / crisp.plates[0].rate
    swap = SWAP.signature(scene, ()).fixed
    inside = slice(20, -20)

    def left(clock):
        fixed = swap + clock.signature(scene, (offset_s,)).fixed
        return np.sqrt(((scene.measured_ground + fixed - true)[inside] ** 2).mean())

    was = np.sqrt(((scene.measured_ground - true)[inside] ** 2).mean())
    assert left(Beyond("all", ClockOffset("all"), SWAP)) < 1e-3 * was
    assert left(ClockOffset("all")) > 0.05 * was  # the clock of the recording as it is


def test_it_goes_by_the_name_of_the_cause(late_and_exchanged):
    gain = PlateGain("plate_2")
    beyond = Beyond(gain.target, gain, SWAP)
    assert beyond.key == gain.key
    assert beyond.about is gain.about
    x, covariance = np.array([0.03]), np.array([[1e-6]])
    scenes = (late_and_exchanged,)
    assert beyond.estimates(scenes, Fitted((), (), x, covariance)) == gain.estimates(
        scenes, Fitted((), (), x, covariance)
    )
    assert beyond.frames(scenes, (), x) == gain.frames(scenes, (), x)


def test_what_cannot_be_corrected_stays(crisp, seen):
    plates = list(crisp.plates)
    plates[1] = replace(plates[1], start_time=0.01)
    scene = seen(replace(crisp, plates=tuple(plates)))
    assert correct_scene(SWAP, scene) is scene
