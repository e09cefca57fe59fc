"""OpenSim 4 documents: components that name each other by paths."""

import posixpath
from collections.abc import Iterator

from solver.common.notes import Kind, Note, noted
from solver.skeleton.osim_document import Node, OsimDocument, children
from solver.skeleton.osim_parts import (
    GROUND,
    JointPart,
    MarkerPart,
    ModelParts,
    Placement,
    body_of,
    origin,
    required_name,
)
from solver.skeleton.skeleton import Geometry

OFFSET_FRAME = "PhysicalOffsetFrame"
SETS = ("BodySet", "JointSet", "ConstraintSet", "MarkerSet", "ComponentSet")  # where frames may live
OWNED = ("components", "frames")  # list properties that hold components


def read_parts(document: OsimDocument) -> ModelParts:
    """Bodies, joints and markers of a document of version 40000 or later."""
    frames = _Frames(document)
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


class _Frames:
    """The document's components by path, and where each frame lies on its body."""

    def __init__(self, document: OsimDocument) -> None:
        self.document = document
        self.components = list(self._walk())
        self.by_path = dict(self.components)
        self._reject_hidden()

    def placed(self, owner: str, node: Node, socket: str) -> Placement:
        """The frame that a component's socket names."""
        target = self.document.word(node, socket)
        if not target:
            raise self.document.error(node, f"<{socket}> is empty; name the frame that it connects to.")
        path = posixpath.normpath(posixpath.join(owner, target))
        return self._placement(path, node, socket, ())

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
            return origin(required_name(self.document, node))
        if node.tag != OFFSET_FRAME:
            raise self.document.error(
                asker,
                f"<{socket}> names '{path}', a {node.tag}; it must name a body, ground or {OFFSET_FRAME}.",
            )
        target = self.document.word(node, "socket_parent")
        if not target:
            raise self.document.error(node, "<socket_parent> is empty; name the frame that it is fixed to.")
        base_path = posixpath.normpath(posixpath.join(path, target))
        base = self._placement(base_path, node, "socket_parent", (*seen, path))
        zero = (0.0, 0.0, 0.0)
        return base.offset(
            self.document.numbers(node, "translation", 3, default=zero),
            self.document.numbers(node, "orientation", 3, default=zero),
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
        for tag in SETS:
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
