"""When each foot stands on the ground, measured by a plate or not."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.runs import runs
from solver.contact.settings import ContactSettings
from solver.contact.sole import soles
from solver.contact.touching import touching
from solver.contact.wrenches import ContactWrenches
from solver.skeleton.skeleton import Skeleton

MEASURED = 0.5  # share of a contact's frames that plates must carry for it to count as measured


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
        return self.loaded >= MEASURED


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
        closed = _without_short_gaps(on_ground[:, foot], round(settings.shortest_gap_s * rate))
        for start, end in runs(closed):
            if end - start >= settings.shortest_phase_s * rate:
                loaded = float(contacts.in_contact[start:end, foot].mean())
                phases.append(ContactPhase(foot, start, end, loaded))
    return tuple(sorted(phases, key=lambda phase: (phase.start, phase.foot)))


def _without_short_gaps(flags: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    closed = flags.copy()
    for start, end in runs(~flags):
        if start > 0 and end < len(flags) and end - start < shortest:
            closed[start:end] = True
    return closed
