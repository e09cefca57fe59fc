from dataclasses import replace

import numpy as np

from solver.contact.detection import wrong_pressure
from solver.contact.detection_settings import DetectionSettings

RATE = 100.0


def found(scene, contacts):
    settings = DetectionSettings()
    return list(wrong_pressure(scene.skeleton, scene.poses(), contacts, RATE, settings))


def standing_on(scene, offset=(0.0, 0.0, 0.0)):
    """Contacts of both feet on a plate each; the right one's centre of pressure moved for half a second."""
    load = np.full(len(scene.ankles), 350.0)
    under = scene.ankles * [1.0, 0.0, 1.0] + [0.05, 0.0, 0.0]
    contacts = scene.assigned(
        scene.plate("r", [(load, under[:, 0])]), scene.plate("l", [(load, under[:, 1])])
    )
    cop = contacts.cop_ground.copy()
    cop[20:70, 0] += offset
    return replace(contacts, cop_ground=cop)


def test_a_centre_of_pressure_under_the_sole_is_right(standing):
    assert found(standing, standing_on(standing)) == []


def test_a_centre_of_pressure_beside_the_sole(standing):
    (proposal,) = found(standing, standing_on(standing, (0.0, 0.0, 0.15)))
    assert (proposal.range, proposal.foot) == ((20, 70), "calcn_r")
    assert proposal.reason == "copOutsideConvexFootError"
    assert 0.07 < proposal.evidence["outside_m"] < 0.15


def test_an_unloaded_foot_has_no_centre_of_pressure_to_speak_of(standing):
    contacts = standing_on(standing, (0.0, 0.0, 0.15))
    light = contacts.wrench_ground.copy()
    light[20:70, 0, 1] = 40.0  # N, of 350
    assert found(standing, replace(contacts, wrench_ground=light)) == []


def test_two_feet_on_one_plate(standing):
    load = np.full(len(standing.ankles), 350.0)
    under = standing.ankles * [1.0, 0.0, 1.0] + [0.05, 0.0, 0.0]
    contacts = standing.assigned(standing.plate("1", [(load, under[:, 0]), (load, under[:, 1])]))
    (proposal,) = found(standing, contacts)
    assert (proposal.range, proposal.foot) == ((0, 100), None)
