"""The frames whose force is known to be unusable before anybody has looked at them."""

import numpy as np

from solver.capture.zero_level import runs
from solver.contact.wrenches import TWO_FEET, ContactWrenches, FrameMask

NOT_RECORDED = "hasNoForcePlateData"  # as the B3D format calls it
TWO_FEET_ON_ONE_PLATE = "two feet on one plate"


def recorded_mask(contacts: ContactWrenches) -> FrameMask:
    """Every frame counts but those that no force was recorded for, and those with two feet on one plate."""
    shared = (contacts.plate == TWO_FEET).any(axis=1)
    counts = np.repeat((contacts.observed & ~shared)[:, None], len(contacts.foot_bodies), axis=1)
    reasons = [(start, end, None, NOT_RECORDED) for start, end in runs(~contacts.observed)]
    reasons += [(start, end, None, TWO_FEET_ON_ONE_PLATE) for start, end in runs(shared & contacts.observed)]
    return FrameMask(counts, tuple(sorted(reasons, key=lambda reason: reason[0])))
