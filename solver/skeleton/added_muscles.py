"""Muscles of another OpenSim model on a skeleton without any, whose bodies have the same names and bones.

Attachments stay where they are on the bones: the mesh that both models draw a body by says how large it is
in either, and where. Lengths of fibres and tendons follow the paths in the neutral pose, as in scaling.
"""

from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.skeleton.muscle_paths import MOVING_POINT, WRAPS, PathLengths, wrap_growth
from solver.skeleton.osim import CURRENT_FROM, read_parts, skeleton_of
from solver.skeleton.osim_document import Node, OsimDocument, children, property_text, read_document
from solver.skeleton.osim_edits import OsimEdits
from solver.skeleton.osim_parts import FRAMES, ZERO, Frames
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton

FIBRE, TENDON = "optimal_fiber_length", "tendon_slack_length"


def with_muscles_of(model: Path, skeleton: Skeleton) -> str:
    """The skeleton's model file, with the muscles and wrapping surfaces of another model.

    Args:
        model: file of a model of OpenSim 4 with muscles.
        skeleton: fitted; its bodies and coordinates have the other model's names.

    Raises:
        ModelError: the file cannot be read, has no muscles, or attaches them to what the skeleton lacks.
    """
    document = read_document(model)
    if document.version < CURRENT_FROM:
        raise ModelError(f"{model}: is of OpenSim 3 or older; open it in OpenSim 4 and save it.")
    donor, frames = skeleton_of(document, read_parts(document)), Frames(document, {})
    places = _places(donor, skeleton)
    nodes = document.members(document.model, "ForceSet")
    muscles = [node for node in nodes if document.words(node, FIBRE) and children(node, "GeometryPath")]
    if not muscles:
        raise ModelError(f"{model}: has no muscles; name a model that has.")
    root = fromstring(skeleton_text(skeleton))
    target = root[0]
    _copy_defaults(document, {node.tag for node in muscles}, target)
    for body in target.iter("Body"):
        _copy_surfaces(document, frames, body, places.get(body.get("name", "")))
    objects = SubElement(SubElement(target, "ForceSet", name="forceset"), "objects")
    for node in muscles:
        objects.append(_placed(document, frames, node, places, skeleton))
    indent(root, "\t")
    text = tostring(root, encoding="UTF-8", xml_declaration=True).decode()
    return _with_lengths(document, PathLengths(document, frames, donor, {}), muscles, text, skeleton)


@dataclass(frozen=True)
class _Place:
    """Where a point of the other model's body is on ours: factors · point + shift."""

    factors: Float[np.ndarray, "3"]
    shift: Float[np.ndarray, "3"]  # [m]

    def __call__(self, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        return self.factors * point + self.shift


def _places(donor: Skeleton, skeleton: Skeleton) -> dict[str, _Place]:
    """By body, from a bone that both draw by the same file."""
    theirs = {(body.name, mesh.file): mesh for body in donor.bodies for mesh in body.geometry}
    places: dict[str, _Place] = {}
    for body in skeleton.bodies:
        for mesh in body.geometry:
            bone = theirs.get((body.name, mesh.file))
            if bone is not None and np.allclose(bone.R_body_mesh, mesh.R_body_mesh):
                factors = mesh.scale / bone.scale
                places.setdefault(body.name, _Place(factors, mesh.p_body_mesh - factors * bone.p_body_mesh))
    return places


def _copy_defaults(document: OsimDocument, kinds: set[str], target: Element) -> None:
    """What the model says of muscles that do not say it themselves."""
    defaults = [deepcopy(node) for tag, node in document.defaults.items() if tag in kinds]
    if defaults:
        SubElement(target, "defaults").extend(defaults)


def _copy_surfaces(document: OsimDocument, frames: Frames, body: Element, place: _Place | None) -> None:
    owners = [node for node in document.model.iter() if isinstance(node, Node) and node.tag in FRAMES]
    copied = []
    for owner in owners:
        frame = frames.of_frame(owner)
        if place is None or frame is None or frame.body != body.get("name"):
            continue
        for node in document.members(owner, "WrapObjectSet"):
            if owner.tag != "Body":
                raise document.error(node, "its frame is no body; attach it to the body itself in OpenSim.")
            copy, own = deepcopy(node), node.tag in WRAPS
            for tag, growth in wrap_growth(document, node, place.factors).items() if own else ():
                _set(copy, tag, document.numbers(node, tag) * growth)
            _set(copy, "translation", place(document.numbers(node, "translation", 3, default=ZERO)))
            copied.append(copy)
    if copied:
        SubElement(SubElement(body, "WrapObjectSet", name="wrapobjectset"), "objects").extend(copied)


def _placed(
    document: OsimDocument, frames: Frames, muscle: Node, places: dict[str, _Place], skeleton: Skeleton
) -> Element:
    copy = deepcopy(muscle)
    twin = dict(zip(muscle.iter(), copy.iter(), strict=True))
    owner = {axis.coordinate: joint.name for joint in skeleton.joints for axis in joint.axes}
    for path in children(muscle, "GeometryPath"):
        for node in document.members(path, "PathPointSet"):
            frame, new = frames.named_by(node), twin[node]
            if node.tag == MOVING_POINT:
                raise document.error(node, "it moves along its body; choose a model whose points are fixed.")
            if frame is None or frame.body not in places:
                on = f"'{frame.body}'" if frame else "no body"
                raise document.error(
                    node,
                    f"it is on {on}, which the skeleton lacks or draws by other bones; choose another model.",
                )
            local = document.numbers(node, "location", 3, default=ZERO)
            _set(new, "location", places[frame.body](frame.p + frame.R @ local))
            _set(new, "socket_parent_frame", f"/bodyset/{frame.body}")
            if coordinate := document.word(node, "socket_coordinate").rpartition("/")[2]:
                if coordinate not in owner:
                    raise document.error(
                        node, f"the skeleton has no coordinate '{coordinate}'; choose another model."
                    )
                _set(new, "socket_coordinate", f"/jointset/{owner[coordinate]}/{coordinate}")
    return copy


def _with_lengths(
    document: OsimDocument, before: PathLengths, muscles: list[Node], text: str, skeleton: Skeleton
) -> str:
    written = read_document(document.path, text)
    edits, after = OsimEdits(written), PathLengths(written, Frames(written, {}), skeleton, {})
    for node, new in zip(muscles, written.members(written.model, "ForceSet"), strict=True):
        ratio = after.of(children(new, "GeometryPath")[0]) / before.of(children(node, "GeometryPath")[0])
        for tag in (FIBRE, TENDON):
            edits.set(new, tag, document.number(node, tag) * ratio)
    return edits.content().decode()


def _set(node: Element, tag: str, value: object) -> None:
    found = node.find(tag)
    (SubElement(node, tag) if found is None else found).text = property_text(value)
