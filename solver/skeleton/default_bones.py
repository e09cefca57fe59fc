"""Which bone meshes draw the default body, and at what scale."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.skeleton.default_frames import BodyFrames
from solver.skeleton.segment_tables import Lengths
from solver.skeleton.skeleton import Geometry

_FILES = {
    "pelvis": ("r_pelvis", "l_pelvis", "sacrum"),
    "femur": ("{s}_femur",),
    "tibia": ("{s}_tibia", "{s}_fibula"),
    "patella": ("{s}_patella",),
    "talus": ("{s}_talus",),
    "calcn": ("{s}_foot",),
    "toes": ("{s}_bofoot",),
    "torso": ("hat_spine", "hat_jaw", "hat_skull", "hat_ribs_scap"),
    "humerus": ("humerus_{s}v",),
    "ulna": ("ulna_{s}v",),
    "radius": ("radius_{s}v",),
    "hand": tuple(
        f"{bone}_{{s}}vs"
        for bone in (
            *("pisiform", "lunate", "scaphoid", "triquetrum", "hamate", "capitate", "trapezoid", "trapezium"),
            *("metacarpal1", "thumb_proximal", "thumb_distal"),
            *(
                f"{part.format(finger)}"
                for number, finger in enumerate(("index", "middle", "ring", "little"), start=2)
                for part in (f"metacarpal{number}", "{}_proximal", "{}_medial", "{}_distal")
            ),
        )
    ),
}


@dataclass(frozen=True)
class DefaultBones:
    """Meshes of one person. The meshes' own sizes are those of the skeleton they were drawn from."""

    lengths: Lengths
    frames: BodyFrames

    def of(self, kind: str, side: str) -> tuple[Geometry, ...]:
        """Meshes of a body, in its own frame; side is "r", "l" or ""."""
        scale = self._scale(kind)
        return tuple(
            Geometry(f"{file.format(s=side)}.vtp", scale, np.eye(3), np.zeros(3)) for file in _FILES[kind]
        )

    def _scale(self, kind: str) -> Float[np.ndarray, "3"]:
        of, frames = self.lengths, self.frames
        if kind == "pelvis":  # hip sockets 5.6 cm behind, 7.8 cm below the spines and 7.7 cm from the midline
            return np.abs(frames.hip_pelvis) / (0.056, 0.078, 0.077)
        if (
            kind == "torso"
        ):  # shoulder sockets 37 cm above and 17 cm beside the lumbar joint, the vertex 65 cm
            vertex = frames.hip_pelvis[1] + of.c7_above_hips + of.head - frames.torso_pelvis[1]
            up = (frames.shoulder_torso[1] / 0.37 + vertex / 0.65) / 2
            return np.array([up, up, of.shoulder_half_width / 0.17])
        if kind in (
            "talus",
            "calcn",
            "toes",
        ):  # from heel to ball 17.9 cm, from ankle down to the heel 4.2 cm
            along = frames.toes_calcn[0] / 0.179
            return np.array([along, -frames.calcn_talus[1] / 0.042, along])
        length = {  # hip to knee, knee to ankle, shoulder to elbow, elbow to wrist [m]
            "femur": of.thigh / 0.404,
            "patella": of.thigh / 0.404,
            "tibia": of.shank / 0.400,
            "humerus": of.upper_arm / 0.287,
            "ulna": of.forearm / 0.262,
            "radius": of.forearm / 0.262,
            "hand": of.hand / 0.086,
        }[kind]
        return np.full(3, length)
