"""The free joint between ground and pelvis: from a pose of the root body to its six coordinates."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from solver.common.errors import ModelError
from solver.skeleton.skeleton import Axis, Joint, Skeleton


@dataclass(frozen=True)
class RootJoint:
    """Three translations and three rotations, each driven by one free coordinate of q."""

    body: int
    joint: Joint
    translations: tuple[Axis, ...]
    rotations: tuple[Axis, ...]
    translation_dofs: Int[np.ndarray, "3"]
    rotation_dofs: Int[np.ndarray, "3"]

    def coordinates(
        self, R_ground_root: Float[np.ndarray, "frames 3 3"], p_ground_root: Float[np.ndarray, "frames 3"]
    ) -> Float[np.ndarray, "frames 6"]:
        """The translation coordinates, then the rotation coordinates, that give the root body this pose.

        The middle angle is kept within a quarter turn of its zero, so neighbouring frames share a branch.
        """
        joint = self.joint
        R = joint.R_parent_frame.T @ R_ground_root @ joint.R_child_frame
        axes = np.array([a.axis for a in self.rotations])
        angles = Rotation.from_matrix(R).as_davenport(axes, "intrinsic")
        offset = R @ joint.R_child_frame.T @ joint.p_child_frame
        along = (p_ground_root - joint.p_parent_frame) @ joint.R_parent_frame + offset
        shifts = np.linalg.solve(np.array([a.axis for a in self.translations]).T, along.T).T
        displacements = np.concatenate([shifts, angles], axis=1)
        for column, axis in enumerate((*self.translations, *self.rotations)):
            intercept, one = axis.function(np.array([0.0, 1.0]))[0]
            displacements[:, column] = (displacements[:, column] - intercept) / (one - intercept)
        return displacements

    @property
    def dofs(self) -> Int[np.ndarray, "6"]:
        """Where `coordinates` go in q."""
        return np.concatenate([self.translation_dofs, self.rotation_dofs])


def root_joint(skeleton: Skeleton) -> RootJoint:
    """The skeleton's free root joint.

    Raises:
        ModelError: not exactly one body hangs on the ground by six free coordinates.
    """
    roots = [i for i, j in enumerate(skeleton.joints) if j.parent < 0]
    if len(roots) != 1:
        names = ", ".join(skeleton.bodies[i].name for i in roots)
        raise ModelError(
            f"{skeleton.name}: exactly one body must be attached to the ground; found {names or 'none'}."
        )
    joint = skeleton.joints[roots[0]]
    free = [a for a in joint.axes if a.coordinate in skeleton.dofs]
    translations = tuple(a for a in free if a.kind == "translation")
    rotations = tuple(a for a in free if a.kind == "rotation")
    if len(translations) != 3 or len(rotations) != 3:
        raise ModelError(
            f"{skeleton.name}: the root joint '{joint.name}' has {len(free)} free coordinates; the fit needs "
            "the three translations and three rotations of a free root. Unlock them in the model."
        )
    return RootJoint(
        body=roots[0],
        joint=joint,
        translations=translations,
        rotations=rotations,
        translation_dofs=np.array([skeleton.dofs.index(str(a.coordinate)) for a in translations]),
        rotation_dofs=np.array([skeleton.dofs.index(str(a.coordinate)) for a in rotations]),
    )
