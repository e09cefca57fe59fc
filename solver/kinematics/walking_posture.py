"""Mean postures that people do not walk in: a sign that a model's places for markers are not the body's.

Nothing that markers on the pelvis do tells how the bone is pitched against them. Where a model has a marker
of the pelvis or the trunk elsewhere than it was worn, the whole walk leans, and hips and back make up for it.
"""

import numpy as np

from solver.kinematics.motion import Motion
from solver.kinematics.settings import KinematicsSettings

HIPS = ("hip_flexion_r", "hip_flexion_l")
STRIDE_S = 0.8  # shorter recordings show no whole step of each leg
STRIDE_DEG = 20.0  # of hip flexion, which people who walk exceed
ALTERNATES = -0.5  # correlation of the two hips below which the legs take turns


def posture_notes(motion: Motion, settings: KinematicsSettings) -> tuple[str, ...]:
    """Warnings of a walk or run whose mean pelvis tilt or lumbar extension people do not have.

    Args:
        motion: by the markers, with OpenSim's names of coordinates.
        settings: ranges of the means.
    """
    if not walks(motion):
        return ()
    notes = []
    for name, what, least, most in (
        ("pelvis_tilt", "pelvis tilt", settings.least_walking_tilt_deg, settings.most_walking_tilt_deg),
        (
            "lumbar_extension",
            "lumbar extension",
            settings.least_walking_lumbar_deg,
            settings.most_walking_lumbar_deg,
        ),
    ):
        if name in motion.dofs:
            mean = float(np.degrees(motion.q[:, motion.dofs.index(name)].mean()))
            if not least <= mean <= most:
                notes.append(
                    f"mean {what} is {mean:.0f}°, and people walk with {least:.0f}° to {most:.0f}°: are the "
                    "model's markers of pelvis and trunk where they were worn? Angles of hips and back are "
                    "off by as much"
                )
    return tuple(notes)


def walks(motion: Motion) -> bool:
    """Whether the legs take turns in strides."""
    if motion.frames < STRIDE_S * motion.rate or not all(hip in motion.dofs for hip in HIPS):
        return False
    right, left = (np.degrees(motion.q[:, motion.dofs.index(hip)]) for hip in HIPS)
    if min(np.ptp(right), np.ptp(left)) < STRIDE_DEG:
        return False
    return bool(np.corrcoef(right, left)[0, 1] < ALTERNATES)
