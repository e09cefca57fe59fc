"""Centres of pressure outside the sole, and plates that two feet share."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from solver.contact.detection_balance import UP
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import COP_OUTSIDE_FOOT, Proposal
from solver.contact.sole import soles
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.runs import runs
from solver.skeleton.skeleton import Skeleton


def wrong_pressure(
    skeleton: Skeleton,
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
    contacts: ContactWrenches,
    rate: float,
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    """Stretches on which a well loaded foot's centre of pressure lies clearly beside its sole.

    Its moment is wrong then, though its force may be right. Where two feet stand on one plate the force
    cannot be divided, and both feet's are missing.

    Args:
        skeleton: scaled.
        poses: orientations and origins of all bodies.
        contacts: forces given to feet.
        rate: [Hz].
        settings: thresholds.
    """
    for foot, sole in enumerate(soles(skeleton, contacts.foot_bodies)):
        load = contacts.wrench_ground[:, foot, UP]
        well = contacts.in_contact[:, foot] & (load > settings.cop_load * load.max(initial=0.0))
        distance = np.where(well, sole.distance(*poses, contacts.cop_ground[:, foot]), 0.0)
        distance = np.nan_to_num(distance)
        for start, end in runs(distance > settings.cop_outside_m):
            if end - start >= settings.cop_outside_s * rate:
                worst = float(distance[start:end].max())
                yield Proposal(
                    (start, end),
                    contacts.foot_bodies[foot],
                    COP_OUTSIDE_FOOT,
                    1.0 - 0.5 * settings.cop_outside_m / worst,
                    {"outside_m": worst, "limit_m": settings.cop_outside_m},
                )
    for start, end in runs((contacts.plate == TWO_FEET).any(axis=1)):
        yield Proposal((start, end), None, COP_OUTSIDE_FOOT, 1.0, {"feet_on_one_plate": 2.0})
