"""How long the paths of muscles and ligaments are in a model's default pose, round wrapping surfaces too.

A path goes straight from point to point, and round a surface where that is in its way: on a cylinder by a
helix, on a sphere by a great circle, on an ellipsoid in the plane through its centre and the two points.
Round a torus it is not followed. A path of several surfaces is laid in passes until each surface knows where
the others lead it. Of these OpenSim 4.6 takes straight parts as the first pass laid them and arcs as the last
did; so do these lengths, since its simulations rest on them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.osim_document import GROUND, Node, OsimDocument, Placement, children
from solver.skeleton.osim_joints import find_function, function_of
from solver.skeleton.osim_parts import FRAMES, ZERO, Frames
from solver.skeleton.rotations import body_fixed_xyz
from solver.skeleton.skeleton import Skeleton

WRAPS = ("WrapCylinder", "WrapSphere", "WrapEllipsoid", "WrapTorus")
SIZES = {"WrapCylinder": ("radius", "length"), "WrapSphere": ("radius",), "WrapEllipsoid": ("dimensions",)}
MOVING_POINT = "MovingPathPoint"
PASSES = 8  # over a path of several surfaces, as in OpenSim
ARC_POINTS = 64  # by which the length of an arc is summed
RANGE_SLACK = (
    1e-5  # [rad or m] by which a coordinate may lie outside of a conditional point's range, as in OpenSim
)

Point = Float[np.ndarray, "3"]


def wrap_growth(
    document: OsimDocument, node: Node, factors: Float[np.ndarray, "3"]
) -> dict[str, Float[np.ndarray, " n"]]:
    """By property, how a wrapping surface grows with its body, as in OpenSim.

    Args:
        document: that the surface is in.
        node: the surface.
        factors: along the axes of its body.
    """
    R = body_fixed_xyz(document.numbers(node, "xyz_body_rotation", 3, default=ZERO))
    along = np.linalg.norm(R * factors[:, None], axis=0)
    across = along[:2].mean(keepdims=True)
    growth = {
        "WrapCylinder": {"radius": across, "length": along[2:]},
        "WrapSphere": {"radius": factors.mean(keepdims=True)},
        "WrapEllipsoid": {"dimensions": along},
        "WrapTorus": {"inner_radius": across, "outer_radius": across},
    }
    return growth[node.tag]


def bodies_of_path(document: OsimDocument, frames: Frames, owner: Node) -> set[str]:
    """Names of the bodies that the path of a muscle runs over, the ground too."""
    points = [
        point for path in children(owner, "GeometryPath") for point in document.members(path, "PathPointSet")
    ]
    return {frame.body for point in points if (frame := frames.named_by(point)) is not None}


class PathLengths:
    """Of one document at one size, in the default pose."""

    def __init__(
        self,
        document: OsimDocument,
        frames: Frames,
        skeleton: Skeleton,
        factors: Mapping[str, Float[np.ndarray, "3"]],
    ) -> None:
        """Pose a model.

        Args:
            document: whose paths they are.
            frames: of the document, at that size.
            skeleton: of the document, at that size.
            factors: by body, of that size over the document's.
        """
        self.document, self.frames, self.skeleton, self.factors = document, frames, skeleton, factors
        poses = ForwardKinematics(skeleton).poses(skeleton.default_q[None])
        places = zip(skeleton.body_names, poses.R_ground_body[0], poses.p_ground_body[0], strict=True)
        self._places = {name: (R, p) for name, R, p in places} | {GROUND: (np.eye(3), np.zeros(3))}

    def of(self, path: Node) -> float:
        """Length of a GeometryPath element [m]; 0 where one of its points is on no known frame."""
        nodes = self.document.members(path, "PathPointSet")
        points = {i: self._point(node) for i, node in enumerate(nodes, start=1) if self._is_active(node)}
        stops = [_Stop(point, point, i, i) for i, point in points.items() if point is not None]
        if len(stops) < max(2, len(points)):
            return 0.0
        wraps = self.document.members(path, "PathWrapSet")
        arcs: dict[int, _Stop] = {}
        straight: dict[int, float] = {}  # by how many arcs there are, between stops as first laid
        for _ in range(PASSES if len(wraps) > 1 else 1):
            for n, wrap in enumerate(wraps):
                stops = [stop for stop in stops if stop is not arcs.get(n)]
                found = self._arcs(wrap, stops)
                if found:
                    detour = {
                        k: arc.length + _straight([stops[k], arc, stops[k + 1]]) - _straight(stops[k : k + 2])
                        for k, arc in found.items()
                    }
                    k = min(detour, key=detour.__getitem__)
                    arcs[n] = found[k]
                    stops.insert(k + 1, arcs[n])
            straight.setdefault(len(stops), _straight(stops))
        return straight[len(stops)] + sum(stop.length for stop in stops)

    def _arcs(self, wrap: Node, stops: list["_Stop"]) -> dict[int, "_Stop"]:
        """Ways round a path's surface, by the stop that they follow."""
        surface = self._surfaces.get(self.document.word(wrap, "wrap_object"))
        if surface is None:
            return {}
        first, last = self.document.numbers(wrap, "range", 2, default=(-1.0, -1.0))
        legs = [
            (k, surface.between(stop, to))
            for k, (stop, to) in enumerate(pairwise(stops))
            if stop.before >= first and (last < 1 or to.after <= last)
        ]
        return {k: arc for k, arc in legs if arc is not None}

    def _is_active(self, node: Node) -> bool:
        if node.tag != "ConditionalPathPoint":
            return True
        low, high = self.document.numbers(node, "range", 2, default=(0.0, 0.0))
        value = self._value(node, "coordinate")
        return bool(low - RANGE_SLACK <= value <= high + RANGE_SLACK)

    def _point(self, node: Node) -> Point | None:
        frame = self.frames.named_by(node)
        if frame is None:
            return None
        place = self.document.numbers(node, "location", 3, default=ZERO)
        if node.tag == MOVING_POINT:
            place = np.array([self._moving(node, axis) for axis in "xyz"])
        R, p = self._places[frame.body]
        return p + R @ (frame.p + frame.R @ (place * self.factors.get(frame.body, 1.0)))

    def _moving(self, node: Node, axis: str) -> float:
        function = find_function(node, f"{axis}_location")
        if function is None:
            return 0.0
        x = np.array([self._value(node, f"{axis}_coordinate")])
        return float(function_of(self.document, function, [axis])[0](x)[0][0])

    def _value(self, node: Node, tag: str) -> float:
        """Of the coordinate that an element names, in the default pose."""
        word = self.document.word(node, f"socket_{tag}") or self.document.word(node, tag)
        name = word.rpartition("/")[2]
        if name not in self._values:
            raise self.document.error(node, f"its <{tag}> '{word}' is no coordinate of the model.")
        return self._values[name]

    @cached_property
    def _values(self) -> dict[str, float]:
        table = {c.name: c for c in self.skeleton.coordinates}

        def value(name: str) -> float:
            c = table[name]
            if c.coupling is None or c.coupled_to is None or c.locked:
                return c.default
            return float(c.coupling(np.array([value(c.coupled_to)]))[0][0])

        return {name: value(name) for name in table}

    @cached_property
    def _surfaces(self) -> dict[str, "_Surface"]:
        found: dict[str, _Surface] = {}
        for owner in (node for node in self.document.model.iter() if isinstance(node, Node)):
            frame = self.frames.of_frame(owner) if owner.tag in FRAMES else None
            for node in self.document.members(owner, "WrapObjectSet") if frame else ():
                if frame and node.tag in SIZES and self.document.flag(node, "active", True):
                    found.setdefault(node.get("name", ""), self._surface(node, frame))
        return found

    def _surface(self, node: Node, frame: Placement) -> "_Surface":
        factors = self.factors.get(frame.body, np.ones(3))
        growth = wrap_growth(self.document, node, factors)
        sizes = [self.document.numbers(node, tag, default=(1.0,)) * growth[tag] for tag in SIZES[node.tag]]
        translation = self.document.numbers(node, "translation", 3, default=ZERO) * factors
        local = frame.offset(translation, self.document.numbers(node, "xyz_body_rotation", 3, default=ZERO))
        R, p = self._places[frame.body]
        quadrant = self.document.word(node, "quadrant").lower()
        side = np.array([float(quadrant.endswith(axis)) for axis in "xyz"]) * (-1 if "-" in quadrant else 1)
        is_long = node.tag == "WrapCylinder"
        semi_axes = (
            np.hstack([sizes[0], sizes[0], sizes[1] / 2]) if is_long else np.hstack(sizes) * np.ones(3)
        )
        return _Surface(R @ local.R, p + R @ local.p, semi_axes, side, is_long)


@dataclass(frozen=True, eq=False)
class _Stop:
    """A point of a path, or its way on a surface; beside which of the path's points it is (1-based)."""

    start: Point  # ground [m]
    end: Point
    before: int
    after: int
    length: float = 0.0  # on the surface [m]


def _straight(stops: list[_Stop]) -> float:
    """Of the ways between stops [m]."""
    return float(np.linalg.norm([stop.end - to.start for stop, to in pairwise(stops)], axis=1).sum())


@dataclass(frozen=True)
class _Surface:
    """A cylinder along its z, or an ellipsoid."""

    R: Float[np.ndarray, "3 3"]  # ground
    p: Point
    semi_axes: Float[np.ndarray, "3"]  # [m]; a cylinder's last is half its length
    side: Float[np.ndarray, "3"]  # that paths are kept to, a direction in its axes; zero: any
    is_cylinder: bool

    def between(self, stop: _Stop, to: _Stop) -> _Stop | None:
        """The way round the surface; None where that is not in the way."""
        start, end = (self.R.T @ (point - self.p) for point in (stop.end, to.start))
        on = self._helix(start, end) if self.is_cylinder else self._arc(start, end)
        if on is None:
            return None
        one, other = (self.p + self.R @ on[k] for k in (0, -1))
        return _Stop(one, other, stop.before, to.after, np.linalg.norm(np.diff(on, axis=0), axis=1).sum())

    def _helix(self, a: Point, b: Point) -> Float[np.ndarray, "points 3"] | None:
        radius = self.semi_axes[0]
        turn = _around(a[:2] / radius, b[:2] / radius, self.side[:2])
        if turn is None:
            return None
        circle = radius * _on_circle(*turn)
        way = [np.linalg.norm(circle[0] - a[:2]), radius * abs(turn[1]), np.linalg.norm(b[:2] - circle[-1])]
        begin, end = np.cumsum(way)[:2] / np.sum(way)
        height = a[2] + (b[2] - a[2]) * np.linspace(begin, end, len(circle))
        if (np.abs(height[[0, -1]]) > self.semi_axes[2]).all():
            return None
        return np.column_stack([circle, height])

    def _arc(self, a: Point, b: Point) -> Float[np.ndarray, "points 3"] | None:
        """As a great circle of the sphere that the ellipsoid is when its axes are made one."""
        a, b = a / self.semi_axes, b / self.semi_axes
        plane = np.linalg.qr(np.column_stack([a, b]))[0]
        turn = _around(a @ plane, b @ plane, self.side @ plane)
        return None if turn is None else _on_circle(*turn) @ plane.T * self.semi_axes


def _on_circle(angle: float, sweep: float) -> Float[np.ndarray, "points 2"]:
    angles = angle + sweep * np.linspace(0, 1, ARC_POINTS)
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _around(
    a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"], side: Float[np.ndarray, "2"]
) -> tuple[float, float] | None:
    """Angle at which a string from a to b meets the unit circle, and by which it follows it [rad].

    None where it goes straight: past the circle, on the side that it is kept to if any, or from within.
    """
    way = b - a
    if min(np.linalg.norm(a), np.linalg.norm(b)) <= 1.0 or not way.any():
        return None
    t = -(a @ way) / (way @ way)
    near = a + t * way
    is_hit = 0 < t < 1 and np.linalg.norm(near) < 1
    a_on, b_on = a @ side > 0, b @ side > 0
    passes_wrong = a_on != b_on and near @ side <= 0
    if not is_hit and (not side.any() or ((a_on or b_on) and not passes_wrong)):
        return None
    slack = np.arccos(1 / np.linalg.norm(a)), np.arccos(1 / np.linalg.norm(b))
    between = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)
    ways = []
    for sense in (1.0, -1.0):
        sweep = (sense * between) % (2 * np.pi) - sum(slack)
        angle = np.arctan2(a[1], a[0]) + sense * slack[0]
        middle = angle + sense * sweep / 2
        ways.append((-sweep, angle, sense * sweep, np.cos(middle) * side[0] + np.sin(middle) * side[1]))
    best = max(ways, key=lambda way: way[3] if side.any() else way[0])
    return (float(best[1]), float(best[2])) if best[0] < 0 else None
