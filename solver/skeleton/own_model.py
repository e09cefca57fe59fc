"""A person's own OpenSim model at the size, mass and joint centres of a fit; all else in its file stays.

Of what lies on a body, points, frames, wrapping surfaces, meshes and moving points follow the body's factors
as OpenSim's scale tool has it, and so do the lengths of muscles and ligaments. Places of contact surfaces
follow too, where that tool leaves them; their radii and all forces do not. What is not known here is carried
over.
"""

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from jaxtyping import Float

from solver.capture.subject.measured_files import MARK
from solver.skeleton.muscle_paths import MOVING_POINT, WRAPS, PathLengths, wrap_growth
from solver.skeleton.osim import LEGACY_BEFORE, read_parts, skeleton_of
from solver.skeleton.osim_document import (
    GROUND,
    JointPart,
    MarkerPart,
    Node,
    Placement,
    children,
    property_text,
    read_document,
)
from solver.skeleton.osim_edits import OsimEdits
from solver.skeleton.osim_joints import TURN_XYZ, find_function, transform_axis
from solver.skeleton.osim_parts import INERTIA_TAGS, OFFSET_FRAME, Frames
from solver.skeleton.osim_writer import component_name
from solver.skeleton.scaling import displacement_factor
from solver.skeleton.skeleton import Marker, Skeleton

LENGTHS = ("optimal_fiber_length", "tendon_slack_length", "resting_length", "slack_length")
CONTACT_FORCES = ("SmoothSphereHalfSpaceForce", "HuntCrossleyForce", "ElasticFoundationForce")
ONES = (1.0, 1.0, 1.0)


def own_model_content(path: Path, skeleton: Skeleton, text: str | None = None) -> bytes:
    """The file of the model that a skeleton was scaled from, as the skeleton is.

    Args:
        path: of the model's file.
        skeleton: the fitted one; its bodies' scales are relative to the file.
        text: of the model, where another kind of file holds it.

    Raises:
        ModelError: the file is no readable model, or not the one that was fitted.
    """
    return _OwnModel(path, skeleton, text).content()


class _OwnModel:
    def __init__(self, path: Path, skeleton: Skeleton, text: str | None) -> None:
        self.document = read_document(path, text)
        self.parts, self.skeleton = read_parts(self.document), skeleton
        self.edits = OsimEdits(self.document)
        self.is_old = self.document.version < LEGACY_BEFORE
        others = {body.name for body in self.parts.bodies} ^ set(skeleton.body_names)
        others |= {part.name for part in self.parts.joints} ^ {joint.name for joint in skeleton.joints}
        if others:
            raise self.document.error(
                self.document.model,
                f"it is not the model that was fitted: only one of the two has {', '.join(sorted(others))}. "
                "Fit again.",
            )
        self.factors = {body.name: body.scale for body in skeleton.bodies} | {GROUND: np.ones(3)}
        self.before, self.after = Frames(self.document, {}), Frames(self.document, self.factors)
        self.own_frames: set[int] = set()  # of joints, which are where the fit has them

    def content(self) -> bytes:
        self._write_bodies()
        for part in self.parts.joints:
            self._write_joint(part)
        self._write_markers()
        self._write_coordinates()
        for node in self.document.members(self.document.model, "ForceSet"):
            if node.tag in CONTACT_FORCES:  # the ground's forces are those of the fit, not twice
                self.edits.set(node, *(("isDisabled", True) if self.is_old else ("appliesForce", False)))
        for node, frame in self._placed(self.document.model, None):
            if frame is not None and frame.body in self.factors:
                self._scale(node, self.factors[frame.body])
        self._write_lengths()
        self.edits.surround(self.document.model, f"<!-- {MARK}: this model at the size of a fit -->\n", "")
        return self.edits.content()

    # ---- what the fit knows ------------------------------------------------------------------------------

    def _write_bodies(self) -> None:
        nodes = {n.get("name"): n for n in self.document.members(self.document.model, "BodySet")}
        for body in self.skeleton.bodies:
            node, inertia = nodes[body.name], body.inertia_body
            self.edits.set(node, "mass", body.mass)
            self.edits.set(node, "mass_center", body.com_body)
            six = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
            if not self.is_old:
                self.edits.set(node, "inertia", six)
            for tag, moment in zip(INERTIA_TAGS, six, strict=True) if self.is_old else ():
                self.edits.set(node, tag, moment)

    def _write_joint(self, part: JointPart) -> None:
        ends = {part.parent.body, part.child.body}
        index = next(
            i
            for i, joint in enumerate(self.skeleton.joints)
            if {self.skeleton.bodies[i].name, self._name(joint.parent)} == ends and joint.name == part.name
        )
        joint, own = self.skeleton.joints[index], self.skeleton.bodies[index].name
        places = {own: joint.p_child_frame, self._name(joint.parent): joint.p_parent_frame}
        if self.is_old:
            holder = self.document.word(part.node, "parent_body")
            parent = GROUND if holder.lower() == GROUND else holder
            (child,) = ends - {parent}
            self.edits.set(part.node, "location_in_parent", places[parent])
            self.edits.set(part.node, "location", places[child])
        else:
            for socket, end in (("socket_parent_frame", part.parent), ("socket_child_frame", part.child)):
                self._write_frame(part, socket, places[end.body])
        factors = self.factors[self._name(joint.parent)]
        for transform in children(part.node, "SpatialTransform"):
            for node in children(transform):
                if (name := node.get("name", "")).startswith("translation"):
                    axis = transform_axis(self.document, node, "translation", TURN_XYZ[int(name[-1]) - 1][1])[
                        0
                    ]
                    self._multiply(node, "function", displacement_factor(axis, factors))

    def _write_frame(self, part: JointPart, socket: str, p_body: Float[np.ndarray, "3"]) -> None:
        path = self.after.target(self.after.paths[id(part.node)], part.node, socket)
        node = self.after.by_path[path]
        if node.tag == OFFSET_FRAME:
            base = self.after.placed(path, node, "socket_parent")
            self.edits.set(node, "translation", base.R.T @ (p_body - base.p))
            self.own_frames.add(id(node))
        elif p_body.any():
            raise self.document.error(
                part.node,
                f"its fitted place on '{node.get('name')}' needs a {OFFSET_FRAME}; add one in OpenSim.",
            )

    def _write_markers(self) -> None:
        left = {component_name(marker.name): marker for marker in self.skeleton.markers}
        for part in self.parts.markers:
            marker = left.pop(component_name(part.node.get("name", "")), None)
            if marker is not None:
                self._write_marker(part, marker)
        if not left:
            return
        sets = children(self.document.model, "MarkerSet")
        objects = children(sets[0], "objects") if sets else []
        xml = "".join(self._marker_xml(name, marker) for name, marker in left.items())
        xml = xml if objects else f"<objects>{xml}</objects>"
        xml = xml if sets else f'<MarkerSet name="markerset">{xml}</MarkerSet>'
        self.edits.append((objects or sets or [self.document.model])[0], xml)

    def _write_marker(self, part: MarkerPart, marker: Marker) -> None:
        frame, body = self.after.named_by(part.node), self.skeleton.bodies[marker.body].name
        if frame is None or frame.body != body:
            self.edits.set(part.node, *self._holder(body))
            frame = Placement(body, np.eye(3), np.zeros(3))
        self.edits.set(part.node, "location", frame.R.T @ (marker.position_body - frame.p))
        self.own_frames.add(id(part.node))

    def _holder(self, body: str) -> tuple[str, str]:
        return ("body", body) if self.is_old else ("socket_parent_frame", f"/bodyset/{body}")

    def _marker_xml(self, name: str, marker: Marker) -> str:
        tag, value = self._holder(self.skeleton.bodies[marker.body].name)
        place, fixed = property_text(marker.position_body), property_text(marker.fixed)
        return (
            f"<Marker name={quoteattr(name)}><{tag}>{escape(value)}</{tag}><location>{place}</location>"
            f"<fixed>{fixed}</fixed></Marker>"
        )

    def _write_coordinates(self) -> None:
        """A coordinate that moves nothing is locked, and none follows a motion of its own."""
        table = {c.name: c for c in self.skeleton.coordinates}
        for part in self.parts.joints:
            for node in part.coordinates:
                coordinate = table.get(node.get("name", ""))
                if coordinate is not None and coordinate.locked and coordinate.coupling is None:
                    self.edits.set(node, "locked", True)
                if self.document.flag(node, "prescribed", False):
                    self.edits.set(node, "prescribed", False)

    def _name(self, body: int) -> str:
        return GROUND if body < 0 else self.skeleton.bodies[body].name

    # ---- what follows a body's factors -------------------------------------------------------------------

    def _placed(self, node: Node, frame: Placement | None) -> Iterator[tuple[Node, Placement | None]]:
        """Every element with the frame that it names, or that it lies in."""
        if node.tag in ("Body", "Ground", OFFSET_FRAME):
            frame = self.before.of_frame(node)
        yield node, self.before.named_by(node) if _is_point(node) else frame
        for child in children(node):
            if child.tag != "defaults":
                yield from self._placed(child, frame)

    def _scale(self, node: Node, factors: Float[np.ndarray, "3"]) -> None:
        if id(node) in self.own_frames:
            return
        if node.tag == OFFSET_FRAME:
            self._times(node, "translation", factors)
        elif _is_point(node):
            self._times(node, "location", factors)
            for axis, factor in zip("xyz", factors, strict=True) if node.tag == MOVING_POINT else ():
                self._multiply(node, f"{axis}_location", factor)
        elif node.tag in WRAPS:
            self._times(node, "translation", factors)
            for tag, growth in wrap_growth(self.document, node, factors).items():
                self._times(node, tag, growth)
        elif node.tag == "attached_geometry":
            for shape in children(node):
                self._times(shape, "scale_factors", factors, ONES)
        elif node.tag == "Body":
            for visible in children(node, "VisibleObject"):
                self._times(visible, "scale_factors", factors, ONES)
                for drawn in (visible, *self.document.members(visible, "GeometrySet")):
                    self._times(drawn, "transform", np.hstack([ONES, factors]))

    def _times(
        self, node: Node, tag: str, factors: Float[np.ndarray, " n"] | float, default: tuple[float, ...] = ()
    ) -> None:
        values = self.document.numbers(node, tag, default=default)
        if len(values) and np.any(np.asarray(factors) != 1.0):
            self.edits.set(node, tag, values * factors)

    def _multiply(self, owner: Node, holder: str, factor: float) -> None:
        """Multiply a function, inside of an element of that name or of the owner itself."""
        function = find_function(owner, holder)
        if function is None or factor == 1.0:
            return
        known = {"Constant": ("value", 0.0), "MultiplierFunction": ("scale", 1.0)}.get(function.tag)
        if known is not None:
            self.edits.set(function, known[0], factor * self.document.number(function, *known))
            return
        name = f' name="{holder}"' if function in owner else ""
        self.edits.surround(
            function,
            f"<MultiplierFunction{name}><function>",
            f"</function><scale>{property_text(factor)}</scale></MultiplierFunction>",
        )

    def _write_lengths(self) -> None:
        """Lengths of muscles and ligaments grow as their paths do in the model's default pose."""
        generic = skeleton_of(self.document, self.parts)
        before = PathLengths(self.document, self.before, generic, {})
        after = PathLengths(self.document, self.after, self.skeleton, self.factors)
        for owner in (node for node in self.document.model.iter() if isinstance(node, Node)):
            for path in children(owner, "GeometryPath"):
                length = before.of(path)
                for tag in LENGTHS if length else ():
                    self._times(owner, tag, after.of(path) / length)


def _is_point(node: Node) -> bool:
    return node.tag == MOVING_POINT or (node.find("location") is not None and not node.tag.endswith("Joint"))
