"""A skeleton as MuJoCo's own model format, MJCF.

Every 1-dof joint of the chain is a hinge or slide of MuJoCo's with a value of its own, those too that follow
another coordinate, such as the translations of a knee; joint equalities hold them to it when the model is
simulated. The ground is turned so that z is up, as MuJoCo's viewers have it: (x, y, z) becomes (x, −z, y).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh.exchange.stl import export_stl

from solver.capture.atomic import made_folder, whole_file, write_whole
from solver.common.file_names import distinct
from solver.export.export_places import file_stem, trial_stems
from solver.fitting.fit_result import Fit
from solver.kinematics.motion import Motion
from solver.skeleton.bones import body_meshes
from solver.skeleton.chain import Chain, Fixed, Moving, chain_of
from solver.skeleton.functions import Linear, ScalarFunction
from solver.skeleton.skeleton import Body, Skeleton

R_WORLD_GROUND = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
LEAST_MASS = 1e-6  # [kg] MuJoCo refuses moving bodies of none; the centre of mass stays within 0.1 µm
LEAST_INERTIA = 1e-8  # [kg·m²] that of a pea
BONE_COLOUR = "0.87 0.83 0.75 1"
MARKER_RADIUS = "0.006"  # [m]
UNSEEN = 1e-12  # [kg·m²] rounding when principal moments are found
POLYNOMIAL = 4  # degree of MuJoCo's joint equalities
SAMPLES = 400  # of a coupling, where a polynomial is laid through it
WIDEST = np.pi  # [rad or m] of a coordinate without a range


@dataclass(frozen=True)
class MujocoModel:
    """An MJCF document and what its columns of qpos are."""

    xml: str
    joints: tuple[str, ...]  # in the order of qpos
    positions: tuple[int, ...]  # of the chain, in the order of qpos
    signs: Float[np.ndarray, " joints"]  # qpos = sign · p
    notes: tuple[str, ...]  # what differs from the skeleton


def mujoco_model(skeleton: Skeleton, mesh_files: Mapping[str, str], mesh_folder: str) -> MujocoModel:
    """The skeleton at its scale; its equalities hold what follows another coordinate by quartics.

    Args:
        skeleton: to write.
        mesh_files: by body, the file in `mesh_folder` with its bone.
        mesh_folder: beside the document.
    """
    return _Writer(skeleton, mesh_files, mesh_folder).model()


def with_least_inertia(body: Body) -> tuple[Body, str]:
    """A body that MuJoCo takes: of some mass, each principal moment at most the sum of the others.

    Returns:
        The body, and what was changed; empty where nothing was.
    """
    moments, axes = np.linalg.eigh(body.inertia_body)
    least = np.maximum(moments, LEAST_INERTIA)
    lacking = least[2] - least[0] - least[1]
    if lacking > UNSEEN:
        least[:2] += lacking / 2
    mass = max(body.mass, LEAST_MASS)
    changes = [f"mass {body.mass:g} to {mass:g} kg"] if mass > body.mass else []
    if (least > moments + UNSEEN).any():
        was, now = (" ".join(f"{m:.3g}" for m in values) for values in (moments, least))
        changes.append(f"principal moments {was} to {now} kg·m²")
    if not changes:
        return body, ""
    changed = replace(body, mass=mass, inertia_body=axes @ np.diag(least) @ axes.T)
    return changed, f"{body.name}: {', '.join(changes)}"


@dataclass(frozen=True)
class _Named:
    """A joint of MuJoCo's: position k of the chain, turned about so that it bears its coordinate's value."""

    name: str
    sign: float
    is_coordinate: bool


class _Writer:
    def __init__(self, skeleton: Skeleton, mesh_files: Mapping[str, str], mesh_folder: str) -> None:
        self.skeleton, self.mesh_files = skeleton, mesh_files
        self.chain: Chain = chain_of(skeleton)
        self.named = _named(skeleton, self.chain)
        self.order: list[int] = []
        self.heavier: list[str] = []
        self.root = Element("mujoco", model=skeleton.name or "skeleton")
        words = {"angle": "radian", "meshdir": mesh_folder, "inertiafromgeom": "false"}
        SubElement(self.root, "compiler", words)
        SubElement(self.root, "option", gravity=_text(R_WORLD_GROUND @ skeleton.gravity))

    def model(self) -> MujocoModel:
        self._assets()
        world = SubElement(self.root, "worldbody")
        SubElement(world, "light", pos="0 0 4", dir="0 0 -1", directional="true")
        SubElement(world, "geom", name="floor", type="plane", size="10 10 0.1", contype="0", conaffinity="0")
        ground = SubElement(world, "body", name="ground", quat=_quaternion(R_WORLD_GROUND))
        placed = {-1: ground}
        for index in range(len(self.skeleton.bodies)):
            placed[index] = self._body(index, placed[self.skeleton.joints[index].parent])
        self._number_joints(ground)
        notes = self._equalities()
        self._default_pose()
        if self.heavier:
            notes = (f"bodies given a minimum inertia: {'; '.join(self.heavier)}", *notes)
        indent(self.root)
        return MujocoModel(
            xml=tostring(self.root, encoding="unicode") + "\n",
            joints=tuple(self.named[k].name for k in self.order),
            positions=tuple(self.order),
            signs=np.array([self.named[k].sign for k in self.order]),
            notes=notes,
        )

    def _assets(self) -> None:
        asset = SubElement(self.root, "asset")
        for body, file in self.mesh_files.items():
            SubElement(asset, "mesh", name=body, file=file, inertia="shell")  # a bone may be an open sheet

    def _body(self, index: int, parent: Element) -> Element:
        """The body with its joints; each turns or slides about where it is with all positions at zero."""
        steps = self.chain.steps[index]
        R, p = _product([step for step in steps if isinstance(step, Fixed)])
        body, change = with_least_inertia(self.skeleton.bodies[index])
        self.heavier += [change] if change else []
        element = SubElement(parent, "body", name=body.name, pos=_text(p), quat=_quaternion(R))
        moments, axes = np.linalg.eigh(body.inertia_body)
        axes = axes * np.sign(np.linalg.det(axes))
        SubElement(
            element,
            "inertial",
            pos=_text(body.com_body),
            quat=_quaternion(axes),
            mass=repr(float(body.mass)),
            diaginertia=_text(moments),
        )
        for number, step in enumerate(steps):
            if isinstance(step, Moving):
                rest = _product([later for later in steps[number:] if isinstance(later, Fixed)])
                self._joint(element, step, *rest)
        if body.name in self.mesh_files:
            looks = {"type": "mesh", "contype": "0", "conaffinity": "0", "group": "1", "rgba": BONE_COLOUR}
            SubElement(element, "geom", looks, mesh=body.name)
        for marker in self.skeleton.markers:
            if marker.body == index:
                place = _text(marker.position_body)
                SubElement(element, "site", name=marker.name, pos=place, size=MARKER_RADIUS, group="3")
        return element

    def _joint(
        self, element: Element, step: Moving, R_rest: Float[np.ndarray, "3 3"], p_rest: Float[np.ndarray, "3"]
    ) -> None:
        """A joint in the frame of its body, which R_rest and p_rest place in the joint's own."""
        joint = self.named[step.index]
        kind = "hinge" if step.kind == "rotation" else "slide"
        place = {"pos": _text(-R_rest.T @ p_rest), "axis": _text(joint.sign * (R_rest.T @ step.axis))}
        made = SubElement(element, "joint", {"name": joint.name, "type": kind, "limited": "false", **place})
        low, high = self._range(step.index)
        if joint.is_coordinate and np.isfinite([low, high]).all() and low < high:
            made.set("range", _text([low, high]))

    def _range(self, position: int) -> tuple[float, float]:
        return self.skeleton.free_coordinates[self.chain.dof[position]].range

    def _number_joints(self, ground: Element) -> None:
        """MuJoCo numbers joints as the document has them, from the top down."""
        position = {joint.name: k for k, joint in enumerate(self.named)}
        self.order = [position[element.get("name", "")] for element in ground.iter("joint")]

    def _equalities(self) -> tuple[str, ...]:
        """Hold each joint that is no coordinate of its own to the one that it follows."""
        drivers = {self.chain.dof[k]: j.name for k, j in enumerate(self.named) if j.is_coordinate}
        worst: dict[str, tuple[float, str]] = {}
        free: list[str] = []
        equality = SubElement(self.root, "equality")
        for k in self.order:
            joint, driver = self.named[k], drivers.get(self.chain.dof[k])
            if joint.is_coordinate:
                continue
            if driver is None:
                free.append(joint.name)
                continue
            coefficients, deviation = _quartic(self.chain.functions[k], self._range(k))
            SubElement(equality, "joint", joint1=joint.name, joint2=driver, polycoef=_text(coefficients))
            unit = "rad" if self._kind(k) == "rotation" else "m"
            worst[unit] = max(worst.get(unit, (0.0, "")), (deviation, joint.name))
        notes = []
        if worst:
            sizes = [f"{size:.2g} {unit} ({name})" for unit, (size, name) in worst.items()]
            notes.append(
                "joints that follow another are held to it by polynomials of the fourth degree, the only "
                f"kind that MuJoCo has; these miss the model's curves by at most {' and '.join(sizes)}. "
                "The motion itself has the model's own values."
            )
        if free:
            notes.append(
                f"no equality holds {', '.join(free)}: no joint bears the coordinate that they follow"
            )
        return tuple(notes)

    def _kind(self, position: int) -> str:
        joint = self.skeleton.joints[self.chain.body[position]]
        return joint.axes[self.chain.axis[position]].kind

    def _default_pose(self) -> None:
        pose = self.chain.couple(self.skeleton.default_q[None])[0][0]
        values = [self.named[k].sign * pose[k] for k in self.order]
        SubElement(SubElement(self.root, "keyframe"), "key", name="default", qpos=_text(values))


def _named(skeleton: Skeleton, chain: Chain) -> list[_Named]:
    """What each position is called: its coordinate where it is one, else its joint with the axis's number."""
    taken: set[str] = set()
    named = []
    for k, function in enumerate(chain.functions):
        joint = skeleton.joints[chain.body[k]]
        axis = joint.axes[chain.axis[k]]
        sign, name = _unit_slope(function), skeleton.dofs[chain.dof[k]]
        is_coordinate = sign != 0.0 and name not in taken
        if not is_coordinate:
            own = axis.coordinate if _unit_slope(axis.function) == 1.0 else None
            name = f"{joint.name}_{axis.kind}{chain.axis[k] + 1}"
            name = own if own is not None and own not in taken | set(skeleton.dofs) else name
            sign = 1.0
        taken.add(name)
        named.append(_Named(name, sign, is_coordinate))
    return named


def _unit_slope(function: ScalarFunction) -> float:
    """1 or −1 where the function is the coordinate itself or its negative, else 0."""
    if isinstance(function, Linear) and function.intercept == 0.0 and abs(function.slope) == 1.0:
        return function.slope
    return 0.0


def _quartic(function: ScalarFunction, span: tuple[float, float]) -> tuple[Float[np.ndarray, "5"], float]:
    """Least-squares polynomial over a coordinate's range, lowest power first, and its largest deviation."""
    low, high = np.clip(np.nan_to_num(span, posinf=WIDEST, neginf=-WIDEST), -WIDEST, WIDEST)
    if not low < high:
        low, high = -WIDEST, WIDEST
    x = np.linspace(low, high, SAMPLES)
    if isinstance(function, Linear):
        return np.array([function.intercept, function.slope, 0.0, 0.0, 0.0]), 0.0
    values = function(x)[0]
    fitted = np.polynomial.Polynomial.fit(x, values, POLYNOMIAL).convert().coef
    coefficients = np.zeros(POLYNOMIAL + 1)
    coefficients[: len(fitted)] = fitted
    return coefficients, float(np.abs(np.polynomial.polynomial.polyval(x, coefficients) - values).max())


def _product(steps: Sequence[Fixed]) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    R, p = np.eye(3), np.zeros(3)
    for step in steps:
        R, p = R @ step.R, p + R @ step.p
    return R, p


def _quaternion(R: Float[np.ndarray, "3 3"]) -> str:
    return _text(Rotation.from_matrix(R).as_quat(scalar_first=True))


def _text(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def export_mujoco(fit: Fit, folder: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Write model.xml, its bones, and TRIAL_motion.npz for every trial.

    Returns:
        The files written, and where the model had to differ from the skeleton.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    meshes, stems = body_meshes(fit.skeleton, fit.subject.folder / "Geometry").meshes, trial_stems(fit)
    motions = {
        stems[trial.capture.name]: trial.dynamics.motion if trial.dynamics else trial.motion
        for trial in fit.trials
    }
    return write_mujoco(made_folder(folder) / "model.xml", fit.skeleton, meshes, motions)


def write_mujoco(
    path: Path, skeleton: Skeleton, meshes: Mapping[str, trimesh.Trimesh], motions: Mapping[str, Motion]
) -> tuple[list[Path], tuple[str, ...]]:
    """Write a model, its bones beside it, and NAME_motion.npz for every motion.

    Args:
        path: of the model.
        skeleton: the model.
        meshes: by body, in its frame.
        motions: by the name that their files get.

    Raises:
        FitError, CaptureError: a folder cannot be made, or not written to.
    """
    place, written = made_folder(path.with_name(f"{path.stem}_bones")), [path]
    files = {body: f"{stem}.stl" for body, stem in distinct(list(meshes), file_stem).items()}
    for body, name in files.items():
        with whole_file(place / name) as file:
            file.write(export_stl(meshes[body]))
        written.append(place / name)
    model = mujoco_model(skeleton, files, place.name)
    write_whole(path, model.xml)
    for name, motion in motions.items():
        written.append(path.with_name(f"{name}_motion.npz"))
        with whole_file(written[-1]) as file:
            np.savez_compressed(file, allow_pickle=False, **mujoco_motion(skeleton, model, motion))
    return written, model.notes


def mujoco_motion(skeleton: Skeleton, model: MujocoModel, motion: Motion) -> dict[str, np.ndarray]:
    """A motion in the joints of a MuJoCo model: the arrays of its file by name."""
    value, slope, curvature = chain_of(skeleton).couple(motion.q)
    dof, order = chain_of(skeleton).dof, list(model.positions)
    velocity = slope * motion.velocity[:, dof]
    acceleration = slope * motion.acceleration[:, dof] + curvature * motion.velocity[:, dof] ** 2
    return {
        "time": motion.times,
        "qpos": model.signs * value[:, order],
        "qvel": model.signs * velocity[:, order],
        "qacc": model.signs * acceleration[:, order],
        "joints": np.array(model.joints),
    }
