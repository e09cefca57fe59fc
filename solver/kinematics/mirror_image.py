"""Left and right exchanged over a whole recording: its markers are those of a person in a mirror.

Labels were exchanged, or axes were (y for z without a sign, a left-handed world). No distance between markers
tells, but the body does: knees bend one way, and toes are before heels.
"""

import numpy as np
from jaxtyping import Float

from solver.common.notes import Kind, Note, noted
from solver.kinematics.calibration import start_poses
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.skeleton import Skeleton

FRAMES = 3  # of a trial
# 65 trials with their sides right cost 1.26 times as much or more in the mirror, on every frame looked at
CLEARLY = 1.2


def mirror_notes(
    skeleton: Skeleton, observed_ground: Float[np.ndarray, "frames markers 3"], settings: KinematicsSettings
) -> tuple[Note, ...]:
    """A warning if the mirror image of a trial's markers is the person's.

    Args:
        skeleton: unscaled, with the markers.
        observed_ground: well-seen frames [m]; a few of them are looked at.
        settings: of the pose fit.
    """
    some = np.linspace(0, len(observed_ground) - 1, min(FRAMES, len(observed_ground))).round().astype(int)
    if not len(some):
        return ()
    as_it_is, mirrored = (
        start_poses(skeleton, observed_ground[some] * (1.0, 1.0, sign), settings)[1] for sign in (1.0, -1.0)
    )
    times = float((as_it_is / mirrored).min())
    if times < CLEARLY:
        return ()
    return noted(
        Kind.WRONG_LABELS,
        "left and right are exchanged over the whole person (a body fits the mirror image "
        f"{times:.1f} times as well): no angle and no length is right; exchange the sides in a markers.toml, "
        "or export again if an axis points the wrong way",
    )
