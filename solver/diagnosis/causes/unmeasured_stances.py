"""Where a foot seems to stand and the balance lacks a force that no plate shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.runs import runs
from solver.contact.contact_phases import contact_phases
from solver.contact.proposals import (
    CONTACT_BUT_NO_FORCE,
    COP_OUTSIDE_FOOT,
    FORCE_DISCREPANCY,
    MISSING_BLIP,
    NOT_OVER_FORCE_PLATE,
    UNMEASURED_EXTERNAL_FORCE,
    ZERO_WHILE_ACCELERATING,
)
from solver.diagnosis.causes.scene import Scene
from solver.diagnosis.causes.time_history import Stretch, joined, stretch_of

EDGE_S = 0.04  # how early and late a sole's motion and a detection may see a contact
SUSPECT_SHARE = 0.08  # of body weight, mean over a stance: worth trying
SUSPECT_ONE_SIGNED = 0.7  # of its frames lack force
GROSS_SHARE = 0.3  # of body weight, likewise: nothing else is looked for there
SHORTEST_SHARE = 0.4  # of the subject's median stance
SHORTEST_S = 0.06  # where no whole stance is known
UP = 1  # y, among the components of a force
REASONS = (
    CONTACT_BUT_NO_FORCE,
    NOT_OVER_FORCE_PLATE,
    FORCE_DISCREPANCY,
    MISSING_BLIP,
    ZERO_WHILE_ACCELERATING,
    COP_OUTSIDE_FOOT,
    UNMEASURED_EXTERNAL_FORCE,
)


@dataclass(frozen=True)
class UnmeasuredStance:
    """A foot that may stand beside the plates."""

    foot_body: str
    stretch: Stretch
    gross: bool  # no plate carries the foot, and much of body weight is lacking


def unmeasured_stances(scenes: Sequence[Scene]) -> list[UnmeasuredStance]:
    """Foot by foot in order of time: long enough, and a deficit of one sign over most of it.

    A foot stands there by its motion or because the detection thinks so, and no plate carries it.
    """
    shortest = shortest_stance_s(scenes)
    found = []
    for scene in scenes:
        missing = missing_force(scene) / scene.weight_N
        for foot, sole in enumerate(scene.soles):
            carried = scene.contacts.in_contact[:, scene.contacts.foot_bodies.index(sole.foot_body)]
            suspects = []
            for start, end in runs(seems_to_stand(scene, foot)):
                cut_off = start == 0 or end == scene.frames
                lacks = missing[start:end]
                if (end - start) / scene.rate < (SHORTEST_S if cut_off else shortest):
                    continue
                if lacks.mean() > SUSPECT_SHARE and (lacks > 0).mean() > SUSPECT_ONE_SIGNED:
                    suspects.append(stretch_of(scene, start, end).widened(EDGE_S))
            for stretch in joined(suspects):
                inside = slice(stretch.start, stretch.end)
                gross = (
                    missing[inside].mean() > GROSS_SHARE and carried[inside].mean() < 1 - SUSPECT_ONE_SIGNED
                )
                found.append(UnmeasuredStance(sole.foot_body, stretch, bool(gross)))
    return found


def missing_force(scene: Scene) -> Float[np.ndarray, " frames"]:
    """Vertical force that the motion demands beyond what was recorded, low-passed [N]."""
    return scene.missing_ground[:, UP]


def seems_to_stand(scene: Scene, foot: int) -> Bool[np.ndarray, " frames"]:
    """Frames on which a foot stands by its motion and no plate carries it, or the detection thinks so."""
    body = scene.soles[foot].foot_body
    column = scene.contacts.foot_bodies.index(body)
    standing = np.zeros(scene.frames, dtype=bool)
    phases = contact_phases(
        scene.contacts,
        scene.R_ground_body,
        scene.p_ground_body,
        skeleton=scene.skeleton,
        rate=scene.rate,
        settings=scene.contact_settings,
    )
    for phase in phases:
        if phase.foot == column:
            standing[phase.start : phase.end] = True
    standing &= ~scene.contacts.in_contact[:, column]
    for proposal in scene.proposals:
        if proposal.foot == body and proposal.reason in REASONS:
            standing[slice(*proposal.range)] = True
    return standing


def shortest_stance_s(scenes: Sequence[Scene]) -> float:
    """Least duration of a missing stance, from the measured ones [s]."""
    lengths = [
        (end - start) / scene.rate
        for scene in scenes
        for foot in scene.contacts.in_contact.T
        for start, end in runs(foot)
        if start > 0 and end < scene.frames
    ]
    return max(SHORTEST_S, SHORTEST_SHARE * float(np.median(lengths))) if lengths else SHORTEST_S
