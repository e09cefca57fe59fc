"""Bodies, joints and markers of OpenSim's documents, of version 4 and of those before.

Of version 4, components name each other by paths; before, joints lie inside bodies.
"""

import posixpath
from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Float

from solver.common.notes import Kind, Note, noted
from solver.skeleton.osim_document import (
    GROUND,
    JointPart,
    MarkerPart,
    ModelParts,
    Node,
    OsimDocument,
    Placement,
    body_of,
    children,
    origin,
    required_name,
)
from solver.skeleton.skeleton import Geometry

OFFSET_FRAME = "PhysicalOffsetFrame"
SETS = ("BodySet", "JointSet", "ConstraintSet", "MarkerSet", "ComponentSet")  # where frames may live
FRAMES = ("Body", "Ground", OFFSET_FRAME)
SOCKETS = ("socket_parent_frame", "socket_frame", "body", "body_name")  # by which a point names its frame
OWNED = ("components", "frames")  # list properties that hold components
INERTIA_TAGS = ("inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz")
ZERO = (0.0, 0.0, 0.0)


def read_current_parts(document: OsimDocument) -> ModelParts:
    """Bodies, joints and markers of a document of version 40000 or later."""
    frames = Frames(document)
    nodes = [node for _, node in frames.components]
    joints = [(path, node) for path, node in frames.components if _is_joint(node)]
    joint_parts = tuple(
        JointPart(
            node=node,
            name=required_name(document, node),
            parent=frames.placed(path, node, "socket_parent_frame"),
            child=frames.placed(path, node, "socket_child_frame"),
            coordinates=tuple(c for block in children(node, "coordinates") for c in children(block)),
        )
        for path, node in joints
    )
    markers = tuple(
        MarkerPart(node=node, frame=frames.placed(path, node, "socket_parent_frame"))
        for path, node in frames.components
        if node.tag == "Marker"
    )
    geometry, notes = frames.geometry()
    bodies = tuple(
        body_of(
            document,
            node,
            inertia=document.numbers(
                node, "inertia", 6, default=None if document.number(node, "mass") > 0 else (0.0,) * 6
            ),
            geometry=tuple(geometry.get(required_name(document, node), ())),
        )
        for node in nodes
        if node.tag == "Body"
    )
    return ModelParts(bodies=bodies, joints=joint_parts, markers=markers, notes=notes)


class Frames:
    """The document's components by path, and where each frame lies on its body.

    Of a document of an older version, the bodies alone: it has no other frames.
    """

    def __init__(
        self, document: OsimDocument, factors: Mapping[str, Float[np.ndarray, "3"]] | None = None
    ) -> None:
        """Read the frames of a document.

        Args:
            document: of any version.
            factors: by body, of the size at which frames are placed, those of forces too; None: of bodies and
                joints, as they are.
        """
        self.document, self._factors = document, factors or {}
        self._sets = SETS if factors is None else (*SETS, "ForceSet")
        self.components = list(self._walk())
        self.by_path = dict(self.components)
        self.paths = {id(node): path for path, node in self.components}
        self._reject_hidden()

    def named_by(self, node: Node) -> Placement | None:
        """The frame that a point, marker or contact surface names; None where it names none that is known."""
        target = next((word for tag in SOCKETS if (word := self.document.word(node, tag))), "").lstrip("./")
        if target.lower() == GROUND:
            return origin(GROUND)
        named = [path for path, n in self.components if n.tag in FRAMES and path.endswith("/" + target)]
        return self._placement(min(named, key=len), node, SOCKETS[0], ()) if target and named else None

    def of_frame(self, node: Node) -> Placement | None:
        """Where a body, the ground or a frame lies; None where its place is in no set that is read."""
        path = self.paths.get(id(node))
        return None if path is None else self._placement(path, node, "socket_parent", ())

    def placed(self, owner: str, node: Node, socket: str) -> Placement:
        """The frame that a component's socket names."""
        target = self.document.word(node, socket)
        if not target:
            raise self.document.error(node, f"<{socket}> is empty; name the frame that it connects to.")
        return self._placement(self.target(owner, node, socket), node, socket, ())

    def target(self, owner: str, node: Node, socket: str) -> str:
        """Path of what a socket of the component at `owner` names."""
        return posixpath.normpath(posixpath.join(owner, self.document.word(node, socket)))

    def geometry(self) -> tuple[dict[str, list[Geometry]], tuple[Note, ...]]:
        """Meshes of each body, in the file's order, and what was left out."""
        meshes: dict[str, list[Geometry]] = {}
        other = 0
        for path, node in self.components:
            for block in children(node, "attached_geometry"):
                for item in children(block):
                    if item.tag != "Mesh":
                        other += 1
                        continue
                    frame = self._placement(path, item, "socket_frame", ())
                    meshes.setdefault(frame.body, []).append(self._mesh(item, frame))
        left_out = other + len(meshes.get(GROUND, ()))
        notes = (
            noted(
                Kind.DRAWING, f"{left_out} geometries that are no bone meshes (shapes, ground) are not drawn"
            )
            if left_out
            else ()
        )
        return meshes, notes

    def _mesh(self, item: Node, frame: Placement) -> Geometry:
        file = self.document.word(item, "mesh_file")
        scale = self.document.numbers(item, "scale_factors", 3, default=(1.0, 1.0, 1.0))
        return Geometry(file=file, scale=scale, R_body_mesh=frame.R, p_body_mesh=frame.p)

    def _placement(self, path: str, asker: Node, socket: str, seen: tuple[str, ...]) -> Placement:
        node = self.by_path.get(path)
        if node is None:
            raise self.document.error(asker, f"<{socket}> names '{path}', which the model does not have.")
        if path in seen:
            raise self.document.error(
                asker, f"its frames are attached in a circle: {' → '.join((*seen, path))}."
            )
        if node.tag == "Ground":
            return origin(GROUND)
        if node.tag == "Body":
            name = required_name(self.document, node)
            return origin(GROUND if name.lower() == GROUND else name)
        if node.tag != OFFSET_FRAME:
            raise self.document.error(
                asker,
                f"<{socket}> names '{path}', a {node.tag}; it must name a body, ground or {OFFSET_FRAME}.",
            )
        target = self.document.word(node, "socket_parent")
        if not target:
            raise self.document.error(node, "<socket_parent> is empty; name the frame that it is fixed to.")
        base = self._placement(self.target(path, node, "socket_parent"), node, "socket_parent", (*seen, path))
        translation = self.document.numbers(node, "translation", 3, default=ZERO)
        return base.offset(
            translation * self._factors.get(base.body, 1.0),
            self.document.numbers(node, "orientation", 3, default=ZERO),
        )

    def _reject_hidden(self) -> None:
        """Bodies and joints inside of components that we know nothing of would be lost."""
        known = {id(node) for _, node in self.components}
        known |= {id(node) for block in children(self.document.model, "defaults") for node in block}
        for node in self.document.model.iter():
            if isinstance(node, Node) and id(node) not in known and _moves(node):
                raise self.document.error(
                    node, "it lies inside of another component; move it to the BodySet or the JointSet."
                )

    def _walk(self) -> Iterator[tuple[str, Node]]:
        model = self.document.model
        for ground in children(model, "Ground"):
            yield f"/{GROUND}", ground
            yield from self._owned(f"/{GROUND}", ground)
        yield from self._owned("", model)
        for tag in self._sets:
            containers = children(model, tag)
            set_path = f"/{containers[0].get('name') or tag.lower()}" if containers else ""
            for node in self.document.members(model, tag):
                path = f"{set_path}/{node.get('name', '')}"
                yield path, node
                yield from self._owned(path, node)

    def _owned(self, path: str, node: Node) -> Iterator[tuple[str, Node]]:
        for block in node:
            if isinstance(block, Node) and block.tag in OWNED:
                for child in children(block):
                    child_path = f"{path}/{child.get('name', '')}"
                    yield child_path, child
                    yield from self._owned(child_path, child)


def _is_joint(node: Node) -> bool:
    return node.tag.endswith("Joint") or node.find("socket_child_frame") is not None


def _moves(node: Node) -> bool:
    return node.tag == "Body" or node.find("socket_child_frame") is not None


def read_legacy_parts(document: OsimDocument) -> ModelParts:
    """Bodies, joints and markers of a document of a version before 30500."""
    nodes = [
        node
        for node in document.members(document.model, "BodySet")
        if required_name(document, node).lower() != GROUND
    ]
    names = {required_name(document, node) for node in nodes}
    bodies = tuple(
        body_of(document, node, inertia=_inertia(document, node), geometry=_geometry(document, node))
        for node in nodes
    )
    joints = tuple(
        _joint(document, body, node, names)
        for body in nodes
        for holder in children(body, "Joint")
        for node in children(holder)
    )
    markers = tuple(
        MarkerPart(node=node, frame=origin(_body_name(document, node, "body", names)))
        for node in document.members(document.model, "MarkerSet")
        if node.tag == "Marker"
    )
    return ModelParts(bodies=bodies, joints=joints, markers=markers)


def _inertia(document: OsimDocument, node: Node) -> Float[np.ndarray, "6"]:
    default = None if document.number(node, "mass") > 0 else 0.0
    return _converted(
        np.array(
            [document.number(node, tag, default if i < 3 else 0.0) for i, tag in enumerate(INERTIA_TAGS)]
        )
    )


def _joint(document: OsimDocument, body: Node, node: Node, names: set[str]) -> JointPart:
    def numbers(tag: str) -> Float[np.ndarray, "3"]:
        return _converted(document.numbers(node, tag, 3, default=ZERO))

    own = required_name(document, body)
    base = origin(_body_name(document, node, "parent_body", names))
    parent = base.offset(numbers("location_in_parent"), numbers("orientation_in_parent"))
    child = origin(own).offset(numbers("location"), numbers("orientation"))
    reverse = document.flag(node, "reverse", False)
    return JointPart(
        node=node,
        name=node.get("name") or own,
        parent=child if reverse else parent,
        child=parent if reverse else child,
        coordinates=tuple(document.members(node, "CoordinateSet")),
    )


def _converted(values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Six significant digits: OpenSim 4 keeps no more of the joint frames and inertias of old documents.

    We follow it to the last digit, so that a motion means the same in both programs.
    """
    return np.array([float(f"{value:.6g}") for value in values])


def _body_name(document: OsimDocument, node: Node, tag: str, names: set[str]) -> str:
    name = document.word(node, tag)
    if name.lower() == GROUND:
        return GROUND
    if name not in names:
        raise document.error(
            node,
            f"<{tag}> names '{name}', which is no body of the model; its bodies: {', '.join(sorted(names))}.",
        )
    return name


def _geometry(document: OsimDocument, body: Node) -> tuple[Geometry, ...]:
    """The meshes of a body's VisibleObject, whose scale factors and transform apply on top of theirs."""
    meshes: list[Geometry] = []
    own = origin(required_name(document, body))
    for visible in children(body, "VisibleObject"):
        outer_frame = _transformed(document, visible, own)
        outer_scale = document.numbers(visible, "scale_factors", 3, default=(1.0, 1.0, 1.0))
        for item in document.members(visible, "GeometrySet"):
            frame = _transformed(document, item, outer_frame)
            scale = outer_scale * document.numbers(item, "scale_factors", 3, default=(1.0, 1.0, 1.0))
            meshes.append(Geometry(document.word(item, "geometry_file"), scale, frame.R, frame.p))
        for file in document.words(visible, "geometry_files"):
            meshes.append(Geometry(file, outer_scale, outer_frame.R, outer_frame.p))
    return tuple(meshes)


def _transformed(document: OsimDocument, node: Node, base: Placement) -> Placement:
    rotation_translation = document.numbers(node, "transform", 6, default=(0.0,) * 6)
    return base.offset(rotation_translation[3:], rotation_translation[:3])
