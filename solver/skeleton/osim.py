"""OpenSim models as skeletons: documents of OpenSim 2.3, 3 and 4."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from solver.common.errors import ModelError
from solver.common.notes import Kind, Note, noted
from solver.skeleton.functions import ScalarFunction, multiply_function
from solver.skeleton.osim_document import (
    GROUND,
    JointPart,
    MarkerPart,
    ModelParts,
    Node,
    OsimDocument,
    read_document,
)
from solver.skeleton.osim_joints import find_function, function_of, joint_motion
from solver.skeleton.osim_parts import read_current_parts, read_legacy_parts
from solver.skeleton.skeleton import Axis, Coordinate, Joint, Marker, Skeleton

LEGACY_BEFORE = 30500  # joints moved out of the bodies
CURRENT_FROM = 40000  # components name each other by sockets; versions between the two were never released
COUPLER = "CoordinateCouplerConstraint"
INERTIA_TOLERANCE = 1e-9  # relative; a body's moments of inertia obey the triangle inequality


def load_skeleton(path: Path | str, text: str | None = None) -> Skeleton:
    """Read an OpenSim model: everything that says how it moves, weighs and carries markers.

    Muscles, other forces, controllers and the like are left out: they are no part of a skeleton. Coordinates
    are named and ordered as OpenSim does. Rotations of Ball and Free joints are described by x-y-z angles and
    their rates, where OpenSim's speeds are an angular velocity.

    Args:
        path: of the model's file.
        text: of the model, where another kind of file holds it.

    Raises:
        ModelError: the file is no readable model, or holds something that a skeleton cannot express.
    """
    document = read_document(Path(path), text)
    return skeleton_of(document, read_parts(document))


def read_parts(document: OsimDocument) -> ModelParts:
    """Bodies, joints and markers of a document of any version that is read.

    Raises:
        ModelError: something of them is missing, or has no meaning.
    """
    if document.version < LEGACY_BEFORE:
        parts = read_legacy_parts(document)
    elif document.version >= CURRENT_FROM:
        parts = read_current_parts(document)
    else:
        raise ModelError(
            f"{document.path}: document version {document.version} is of a trial version of OpenSim 4; "
            "open the model in OpenSim and save it."
        )
    if not parts.bodies:
        raise document.error(document.model, "it has no bodies.")
    return parts


def skeleton_of(document: OsimDocument, parts: ModelParts) -> Skeleton:
    """The skeleton that a document's parts make.

    Raises:
        ModelError: it cannot be one.
    """
    _reject_duplicates(document, parts)
    links = _links(document, parts)
    order = _topological([body.name for body in parts.bodies], links)
    index = {name: i for i, name in enumerate(order)} | {GROUND: -1}
    bodies = {body.name: body for body in parts.bodies}

    motions = {id(part): joint_motion(document, part) for part in parts.joints}
    notes = [*parts.notes, *(note for motion in motions.values() for note in motion.notes)]
    joints = tuple(_joint(document, links[name], motions[id(links[name].part)].axes, index) for name in order)
    coordinates = [c for part in parts.joints for c in motions[id(part)].coordinates]
    coordinates, coupler_notes = _coupled(document, _unique(document, coordinates))
    markers, marker_notes = _markers(document, parts.markers, index)
    return Skeleton(
        name=document.model.get("name") or document.path.stem,
        bodies=tuple(bodies[name] for name in order),
        joints=joints,
        coordinates=tuple(coordinates),
        markers=markers,
        gravity=document.numbers(document.model, "gravity", 3, default=(0.0, -9.80665, 0.0)),
        notes=(*notes, *coupler_notes, *marker_notes, *_inertia_notes(parts)),
    )


# ---- the tree -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Link:
    """How a body hangs in the tree; `reversed` when its joint counts it as the parent."""

    part: JointPart
    parent: str
    reversed: bool


def _reject_duplicates(document: OsimDocument, parts: ModelParts) -> None:
    names = [body.name for body in parts.bodies]
    for name in names:
        if names.count(name) > 1:
            raise document.error(
                document.model, f"{names.count(name)} bodies are called '{name}'; rename them."
            )


def _links(document: OsimDocument, parts: ModelParts) -> dict[str, _Link]:
    """Walk from the ground along the joints; every body must be reached exactly once."""
    links: dict[str, _Link] = {}
    reached = {GROUND}
    waiting = list(parts.joints)
    while waiting:
        steps = [_step(part, reached) for part in waiting]
        step = next((s for s in steps if s is not None), None)
        if step is None:
            break
        body, link = step
        if body in reached:
            raise document.error(
                link.part.node,
                f"it closes a loop: '{body}' hangs on another joint already. Loops are not supported; "
                "remove one of the joints.",
            )
        links[body] = link
        reached.add(body)
        waiting = [part for part in waiting if part is not link.part]
    loose = [body.name for body in parts.bodies if body.name not in reached]
    if loose:
        raise document.error(
            document.model,
            f"no chain of joints leads from the ground to {', '.join(loose)}; add a joint for each.",
        )
    return links


def _step(part: JointPart, reached: set[str]) -> tuple[str, _Link] | None:
    if part.parent.body in reached:
        return part.child.body, _Link(part, part.parent.body, False)
    if part.child.body in reached:
        return part.parent.body, _Link(part, part.child.body, True)
    return None


def _topological(names: Sequence[str], links: dict[str, _Link]) -> list[str]:
    """The file's order of bodies, but parents before children."""
    order: list[str] = []
    for name in names:
        chain = [name]
        while links[chain[-1]].parent != GROUND:
            chain.append(links[chain[-1]].parent)
        order += [body for body in reversed(chain) if body not in order]
    return order


def _joint(document: OsimDocument, link: _Link, axes: tuple[Axis, ...], index: dict[str, int]) -> Joint:
    part = link.part
    near, far = (part.child, part.parent) if link.reversed else (part.parent, part.child)
    return Joint(
        name=part.name,
        parent=index[link.parent],
        R_parent_frame=near.R,
        p_parent_frame=near.p,
        R_child_frame=far.R,
        p_child_frame=far.p,
        axes=_inverted(document, part, axes) if link.reversed else axes,
    )


def _inverted(document: OsimDocument, part: JointPart, axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """The axes of the joint seen from its child: opposite directions in opposite order."""
    if len({axis.kind for axis in axes}) > 1:
        raise document.error(
            part.node,
            f"it is reversed ('{part.child.body}' is nearer to the ground than '{part.parent.body}') "
            "and both turns and slides; exchange its parent and child in OpenSim.",
        )
    return tuple(replace(axis, axis=-axis.axis) for axis in reversed(axes))


# ---- coordinates ----------------------------------------------------------------------------------------


def _unique(document: OsimDocument, coordinates: list[Coordinate]) -> list[Coordinate]:
    names = [c.name for c in coordinates]
    for name in names:
        if names.count(name) > 1:
            raise document.error(
                document.model,
                f"{names.count(name)} coordinates are called '{name}'; give each a name of its own.",
            )
    return coordinates


def _coupled(document: OsimDocument, coordinates: list[Coordinate]) -> tuple[list[Coordinate], list[Note]]:
    table = {c.name: c for c in coordinates}
    notes: list[Note] = []
    for node in document.members(document.model, "ConstraintSet"):
        if node.tag != COUPLER:
            if not _enforced(document, node):
                continue
            raise document.error(
                node,
                f"constraints of type {node.tag} are not supported, only {COUPLER}; remove or disable it.",
            )
        if not _enforced(document, node):
            notes += noted(
                Kind.OTHER, f"coupling '{node.get('name')}' is switched off in the model; it is ignored"
            )
            continue
        dependent, function, driver = _coupling(document, node, table)
        if table[dependent].locked:
            notes += noted(
                Kind.OTHER,
                f"coordinate '{dependent}' is locked and coupled; the lock holds, the coupling is ignored",
            )
        elif driver is None:
            value = float(function(np.zeros(1))[0][0])
            table[dependent] = replace(table[dependent], locked=True, default=value)
        else:
            table[dependent] = replace(table[dependent], coupling=function, coupled_to=driver)
    return list(table.values()), notes


def _enforced(document: OsimDocument, node: Node) -> bool:
    disabled = document.flag(node, "isDisabled", False)
    return document.flag(node, "isEnforced", not disabled)


def _coupling(
    document: OsimDocument, node: Node, table: dict[str, Coordinate]
) -> tuple[str, ScalarFunction, str | None]:
    """Dependent coordinate, function, and the coordinate that drives it, if any."""
    dependent = document.word(node, "dependent_coordinate_name")
    independent = document.words(node, "independent_coordinate_names")
    for name in (dependent, *independent):
        if name not in table:
            raise document.error(node, f"it couples '{name}', which is no coordinate of the model.")
    if table[dependent].coupling is not None:
        raise document.error(node, f"'{dependent}' is coupled twice; keep one of the two constraints.")
    function_node = find_function(node, "coupled_coordinates_function")
    if function_node is None:
        raise document.error(node, "it has no <coupled_coordinates_function>.")
    function, driver = function_of(document, function_node, independent)
    factor = document.number(node, "scale_factor", 1.0)
    return dependent, multiply_function(function, factor), driver


# ---- markers and masses ---------------------------------------------------------------------------------


def _markers(
    document: OsimDocument, parts: Sequence[MarkerPart], index: dict[str, int]
) -> tuple[tuple[Marker, ...], list[Note]]:
    markers: dict[str, Marker] = {}
    notes: list[Note] = []
    for part in parts:
        name = part.node.get("name", "")
        if part.frame.body == GROUND:
            notes += noted(Kind.OTHER, f"marker '{name}' is attached to the ground; it is left out")
        elif not name or name in markers:
            raise document.error(part.node, "markers need names of their own; rename this one.")
        else:
            location = document.numbers(part.node, "location", 3, default=(0.0, 0.0, 0.0))
            markers[name] = Marker(
                name=name,
                body=index[part.frame.body],
                position_body=part.frame.p + part.frame.R @ location,
                fixed=document.flag(part.node, "fixed", False),
            )
    return tuple(markers.values()), notes


def _inertia_notes(parts: ModelParts) -> list[Note]:
    notes: list[Note] = []
    for body in parts.bodies:
        moments = np.linalg.eigvalsh(body.inertia_body)
        if moments[2] > (moments[0] + moments[1]) * (1 + INERTIA_TOLERANCE):
            notes += noted(
                Kind.BARE_BODIES,
                f"body '{body.name}': no rigid body has its moments of inertia; they are used as they are",
            )
    return notes
