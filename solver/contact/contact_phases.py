"""When each foot stands on the ground, measured by a plate or not.

Which feet touch the ground, from their motion: low, and moving with the surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.true_runs import runs
from solver.contact.settings import SHORTEST_CONTACT_S, ContactSettings
from solver.contact.sole import soles
from solver.contact.wrenches import ContactWrenches
from solver.skeleton.skeleton import Skeleton

SHORTEST_STANDING_S = 0.1  # [s] of loaded frames from which a foot's height above the ground is learnt
# [s] shorter touches are markers' noise; a sprinter's contact lasts 0.09 s
SHORTEST_PHASE_S = SHORTEST_CONTACT_S
SHORTEST_GAP_S = 0.03  # [s] shorter lifts inside a contact phase are noise; a running flight lasts 0.08 s

MEASURED_SHARE = 0.5  # share of a contact's frames that plates must carry for it to count as measured


def touching(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    standing: Bool[np.ndarray, "frames feet"],
    rate: float,
    settings: ContactSettings,
) -> Bool[np.ndarray, "frames feet"]:
    """Whether any corner of a foot's sole is as low as when it is loaded, and does not slide.

    The loaded frames tell how high each foot's lowest corner then is, so the sole's depth and the plates'
    height need not be known to the centimetre, and how fast the surface moves (a treadmill's belt). Where
    there are too few, the foot's own low frames tell.

    Args:
        corners_ground: of each foot's sole [m].
        standing: frames on which a plate certainly carries the foot.
        rate: [Hz].
        settings: thresholds.
    """
    frames = standing.shape[0]
    if frames < 2 or not corners_ground:
        return standing.copy()
    lowest = np.column_stack([corners[..., 1].min(axis=1) for corners in corners_ground])
    velocities = [np.gradient(corners, 1.0 / rate, axis=0)[..., [0, 2]] for corners in corners_ground]
    enough = SHORTEST_STANDING_S * rate
    reach = [
        _level(lowest, standing, f, enough) + settings.touch_height_m for f in range(len(corners_ground))
    ]
    certain = standing if standing.sum() >= enough else lowest <= reach
    surface = _surface_velocity(corners_ground, velocities, certain)
    touches = np.zeros_like(standing)
    for f, (corners, velocity) in enumerate(zip(corners_ground, velocities, strict=True)):
        slow = np.linalg.norm(velocity - surface, axis=2) <= settings.touch_speed_m_s
        touches[:, f] = ((corners[..., 1] <= reach[f]) & slow).any(axis=1)
    return touches


def _level(
    lowest: Float[np.ndarray, "frames feet"],
    standing: Bool[np.ndarray, "frames feet"],
    foot: int,
    enough: float,
) -> float:
    """Height of a foot's lowest corner while loaded [m]: its own, else any foot's, else as low as it gets."""
    if standing[:, foot].sum() >= enough:
        return float(np.median(lowest[standing[:, foot], foot]))
    if standing.sum() >= enough:
        return float(np.median(lowest[standing]))
    return float(np.percentile(lowest[:, foot], 5))


def _surface_velocity(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    velocities: Sequence[Float[np.ndarray, "frames corners 2"]],
    standing: Bool[np.ndarray, "frames feet"],
) -> Float[np.ndarray, "2"]:
    """Median velocity of the lowest corners of standing feet [m/s]."""
    frames = np.arange(len(standing))
    samples = [
        velocity[frames, corners[..., 1].argmin(axis=1)][standing[:, f]]
        for f, (corners, velocity) in enumerate(zip(corners_ground, velocities, strict=True))
    ]
    return np.median(np.concatenate(samples), axis=0)


@dataclass(frozen=True)
class ContactPhase:
    """One foot on the ground from frame `start` up to, not including, frame `end`."""

    foot: int  # index into `ContactWrenches.foot_bodies`
    start: int
    end: int
    loaded: float  # share of its frames on which a plate carries the foot; 0: nothing was measured

    @property
    def is_measured(self) -> bool:
        """Whether plates carry the foot on half of its frames or more."""
        return self.loaded >= MEASURED_SHARE


def contact_phases(
    contacts: ContactWrenches,
    R_ground_body: Float[np.ndarray, "frames bodies 3 3"],
    p_ground_body: Float[np.ndarray, "frames bodies 3"],
    *,
    skeleton: Skeleton,
    rate: float,
    settings: ContactSettings,
) -> tuple[ContactPhase, ...]:
    """Contact phases in order of time: a plate carries the foot, or the foot's motion says that it stands.

    Args:
        contacts: assigned forces.
        R_ground_body: orientations of the skeleton's bodies.
        p_ground_body: their origins [m].
        skeleton: scaled.
        rate: [Hz].
        settings: thresholds.
    """
    corners = [
        sole.corners_ground(R_ground_body, p_ground_body) for sole in soles(skeleton, contacts.foot_bodies)
    ]
    on_ground = contacts.in_contact | touching(corners, contacts.in_contact, rate, settings)
    phases = []
    for foot in range(len(contacts.foot_bodies)):
        closed = _without_short_gaps(on_ground[:, foot], round(SHORTEST_GAP_S * rate))
        for start, end in runs(closed):
            if end - start >= SHORTEST_PHASE_S * rate:
                loaded = float(contacts.in_contact[start:end, foot].mean())
                phases.append(ContactPhase(foot, start, end, loaded))
    return tuple(sorted(phases, key=lambda phase: (phase.start, phase.foot)))


def _without_short_gaps(flags: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    closed = flags.copy()
    for start, end in runs(~flags):
        if start > 0 and end < len(flags) and end - start < shortest:
            closed[start:end] = True
    return closed
