"""2. Markers and plates that lie in memory: no file is needed.

Here the arrays are the demo's: a stretch of it, turned to a laboratory whose z axis points up. Yours may
come from any reader: metres, newtons, seconds, forces on the person.
"""

import numpy as np

from addb_viewer import Plate, Subject

recorded = Subject.demo("demo_subject").recording("walk")
R_LAB_GROUND = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # y up to z up
seen = recorded.times < 1.5  # [s]


def in_lab(vectors, kept):
    """A stretch of vectors [samples, ..., 3] in the laboratory's axes."""
    return vectors[kept] @ R_LAB_GROUND.T


plates = []
for plate in recorded.plates:
    kept = plate.times < 1.5  # [s]
    force, moment = in_lab(plate.force, kept), in_lab(plate.moment, kept)
    plates.append(Plate(force, plate.times[kept], moment=moment))  # about the laboratory's origin

subject = Subject.from_arrays(
    in_lab(recorded.markers, seen),
    recorded.marker_names,
    recorded.times[seen],
    plates=plates,
    up="z",
    name="stretch",
    mass_kg=71.0,
    height_m=1.74,
)
fit = subject.fit()
print(fit)

stretch = fit["stretch"]
print(stretch.coordinates)
print(f"largest knee flexion {np.rad2deg(stretch.coordinates['knee_angle_r'].max()):.0f}°")
