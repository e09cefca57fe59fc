"""Recorded steps, with the motion that others fitted to them: every contact finds its foot."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.capture.formats.storage import coordinates_from_storage, read_storage
from solver.capture.plates.conditioning import ConditionedPlate, condition
from solver.capture.plates.moment_convention import plates_from_storage
from solver.contact.assignment import assign
from solver.contact.settings import ContactSettings
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.skeleton.forward import body_poses
from solver.skeleton.osim import load_skeleton

pytestmark = pytest.mark.real

GAIT2354 = "walk_gait2354_subject01"
RECORDINGS = {  # model, motion, forces; the first plate is the right foot's, the second the left one's
    "treadmill": (
        f"{GAIT2354}/reference/subject01_simbody.osim",
        f"{GAIT2354}/reference/subject01_walk1_ik.mot",
        f"{GAIT2354}/subject01_walk1_grf.mot",
    ),
    "overground": (
        "opencap_subject4/reference/manually_scaled.osim",
        "opencap_subject4/reference/walking1_manual_scaling_ik.mot",
        "opencap_subject4/ForceData/walking1_grf.mot",
    ),
    "drop jump": (
        "opencap_subject4/reference/manually_scaled.osim",
        "opencap_subject4/reference/DJ1_manual_scaling_ik.mot",
        "opencap_subject4/ForceData/DJ1_grf.mot",
    ),
    "sprint": (
        "sprint_overground_dorn2012_JA1_9ms/reference/hand_scaled.osim",
        "sprint_overground_dorn2012_JA1_9ms/reference/run0900cms_expert_ik.mot",
        "sprint_overground_dorn2012_JA1_9ms/sprint_grf.mot",
    ),
}


@dataclass
class Recording:
    skeleton: object
    times: np.ndarray
    poses: tuple[np.ndarray, np.ndarray]
    plates: list[ConditionedPlate]

    def assigned(self, *plates: ConditionedPlate) -> ContactWrenches:
        return assign(
            plates,
            *self.poses,
            skeleton=self.skeleton,
            foot_bodies=("calcn_r", "calcn_l"),
            times=self.times,
            settings=ContactSettings(),
        )


@pytest.fixture(params=RECORDINGS)
def recording(request, real_data) -> Recording:
    model, motion, forces = (real_data / part for part in RECORDINGS[request.param])
    skeleton = load_skeleton(model)
    angles = [c.name for c in skeleton.coordinates if c.motion == "rotation"]
    coordinates = coordinates_from_storage(read_storage(motion), angles)
    columns = [coordinates.names.index(name) for name in skeleton.dofs]
    plates, _ = plates_from_storage(read_storage(forces))
    return Recording(
        skeleton,
        coordinates.times,
        body_poses(skeleton, coordinates.values[:, columns]),
        [condition(plate, coordinates.times) for plate in plates],
    )


def test_every_contact_finds_its_foot_whatever_the_plates_order(recording):
    right, left = recording.plates[:2]
    for plates, feet in (((right, left), (0, 1)), ((left, right), (1, 0))):
        found = recording.assigned(*plates)
        for k, foot in enumerate(feet):
            assert set(found.plate[plates[k].loaded, k]) == {foot}


def test_all_steps_on_a_single_plate(recording):
    """The plates' wrenches added up: single support finds its foot, double support goes to neither."""
    right, left = recording.plates[:2]
    found = recording.assigned(_merged(right, left)).plate[:, 0]
    load = np.column_stack([p.force_ground[:, 1] * p.loaded for p in (right, left)])
    both = load.min(axis=1) > 0.15 * load.sum(axis=1)
    alone = (load > 0).sum(axis=1) == 1
    owner = load.argmax(axis=1)
    assert not (alone & (found >= 0) & (found != owner)).any()
    if alone.sum() > 20:  # in the drop jump there is hardly any
        assert np.mean(found[alone] == owner[alone]) > 0.9
    if both.any():
        assert np.mean(found[both] == TWO_FEET) > 0.9


def _merged(one: ConditionedPlate, other: ConditionedPlate) -> ConditionedPlate:
    force = one.force_ground + other.force_ground
    moment = one.moment_ground + other.moment_ground
    loaded = one.loaded | other.loaded
    height = np.nanmax([one.cop_ground[loaded, 1], other.cop_ground[loaded, 1]], axis=0)
    F, M = force[loaded], moment[loaded]
    cop = np.full_like(force, np.nan)
    cop[loaded] = np.column_stack(
        [(M[:, 2] + height * F[:, 0]) / F[:, 1], height, (height * F[:, 2] - M[:, 0]) / F[:, 1]]
    )
    return replace(
        one, name="merged", force_ground=force, moment_ground=moment, cop_ground=cop, loaded=loaded
    )
