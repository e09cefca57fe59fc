"""An OpenSim model file as XML: located elements, typed properties, and errors that say where."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

import numpy as np
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.common.notes import Note
from solver.skeleton.rotations import body_fixed_xyz
from solver.skeleton.skeleton import Body, Geometry

OLDEST_VERSION = (
    10901  # OpenSim 1.9 gave custom joints their SpatialTransform; older ones are laid out otherwise
)
LARGEST_FILE = 32 * 2**20  # bytes; models with all muscles and wraps of a body have 5 MB
LONGEST_TEXT = 1_000_000  # characters of one property; a long list of spline points has 10 000
DEEPEST = (
    200  # elements within one another; OpenSim's models have 20, and far deeper ones crash Python itself
)
MOST_PARTS = 1_000_000  # elements and attributes; the largest published models have a tenth of it
GROUND = "ground"
ROUNDING = 1e-6  # of the largest moment; files print as few as six digits


class Node(Element):
    """An XML element that knows its line."""

    line: int = 0
    start: int = 0  # of its first tag in the file [bytes]
    end: int = 0  # of its last tag; behind the tag where it is one alone

    @property
    def label(self) -> str:
        """How people find it in the file: Body 'pelvis'."""
        name = self.get("name")
        return f"{self.tag} '{name}'" if name else f"<{self.tag}>"


@dataclass(frozen=True)
class OsimDocument:
    """A parsed model file.

    `defaults` holds one element per type: what an element of that type means when it lacks a property.
    """

    path: Path
    version: int
    model: Node
    defaults: dict[str, Node]
    content: bytes  # of the file

    def error(self, node: Node, problem: str) -> ModelError:
        """An error that points at an element."""
        return ModelError(f"{self.path}:{node.line}: {node.label}: {problem}")

    def property(self, node: Node, tag: str) -> Node | None:
        """The child element of that name, the type's default where it is absent, or None."""
        found = node.find(tag)
        if found is None and node.tag in self.defaults and node is not self.defaults[node.tag]:
            found = self.defaults[node.tag].find(tag)
        return found if isinstance(found, Node) else None

    def words(self, node: Node, tag: str) -> list[str]:
        """The property's text, split at white space; empty when absent."""
        found = self.property(node, tag)
        return (found.text or "").split() if found is not None else []

    def word(self, node: Node, tag: str) -> str:
        """The property's text; empty when absent."""
        found = self.property(node, tag)
        return (found.text or "").strip() if found is not None else ""

    def flag(self, node: Node, tag: str, default: bool) -> bool:
        """A true/false property."""
        text = self.word(node, tag).lower()
        if not text:
            return default
        if text not in ("true", "false", "1", "0"):
            raise self.error(node, f"<{tag}> is '{text}'; write true or false.")
        return text in ("true", "1")

    def numbers(
        self,
        node: Node,
        tag: str,
        count: int | None = None,
        default: tuple[float, ...] | None = None,
        infinite: bool = False,
    ) -> Float[np.ndarray, " count"]:
        """A property that holds numbers.

        Args:
            node: the element that owns the property.
            tag: the property's name.
            count: how many numbers there must be; None for any.
            default: what an absent or empty property means; None makes it an error.
            infinite: whether infinite values are allowed.
        """
        texts = self.words(node, tag)
        if not texts:
            if default is None:
                raise self.error(node, f"<{tag}> is missing or empty; the model needs its value.")
            return np.array(default)
        try:
            values = np.array([float(text) for text in texts])
        except ValueError:
            bad = next(text for text in texts if not _is_number(text))
            raise self.error(node, f"'{bad}' in <{tag}> is not a number.") from None
        if count is not None and len(values) != count:
            raise self.error(node, f"<{tag}> holds {len(values)} numbers; it needs {count}.")
        if np.isnan(values).any() or (not infinite and not np.isfinite(values).all()):
            raise self.error(node, f"<{tag}> is '{' '.join(texts)}'; it needs finite numbers.")
        return values

    def number(self, node: Node, tag: str, default: float | None = None) -> float:
        """A property that holds one number."""
        return float(self.numbers(node, tag, 1, None if default is None else (default,))[0])

    def members(self, owner: Node, set_tag: str) -> list[Node]:
        """The objects of one of the owner's sets (BodySet, JointSet, …)."""
        members: list[Node] = []
        for container in children(owner, set_tag):
            file = container.get("file", "")
            if file not in ("", "Unassigned"):
                raise self.error(
                    container,
                    f"its members lie in another file ({file}). Save the model as one file in OpenSim.",
                )
            for objects in children(container, "objects"):
                members += children(objects)
        return members


def read_document(path: Path, text: str | None = None) -> OsimDocument:
    """Parse a model file, refusing entities and document type definitions.

    Args:
        path: of the file, for messages.
        text: of the model, where another kind of file holds it; None: that of the file.

    Raises:
        ModelError: the file cannot be read, is not XML, or is not an OpenSim model.
    """
    root, content = _parse(path, text)
    if root.tag != "OpenSimDocument":
        raise ModelError(
            f"{path}:{root.line}: the root element is <{root.tag}>; an .osim file has <OpenSimDocument>."
        )
    version = root.get("Version", "")
    if not version.isdigit():
        raise ModelError(
            f"{path}:{root.line}: <OpenSimDocument> has no numeric Version; save the model with OpenSim."
        )
    if int(version) < OLDEST_VERSION:
        raise ModelError(
            f"{path}:{root.line}: document version {version} is older than OpenSim 2; "
            "open the model in OpenSim and save it."
        )
    model = root.find("Model")
    if not isinstance(model, Node):
        raise ModelError(
            f"{path}:{root.line}: there is no <Model> in the document; give the model's .osim file."
        )
    defaults = {node.tag: node for block in children(model, "defaults") for node in children(block)}
    return OsimDocument(path, int(version), model, defaults, content)


def children(node: Node, tag: str | None = None) -> list[Node]:
    """Child elements, of one name or all."""
    return [child for child in node if isinstance(child, Node) and (tag is None or child.tag == tag)]


def _parse(path: Path, text: str | None) -> tuple[Node, bytes]:
    def located(tag: str, attributes: dict[str, str]) -> Node:
        node = Node(tag, attributes)
        node.line, node.start = parser.parser.CurrentLineNumber, parser.parser.CurrentByteIndex
        return node

    def closed(node: Element) -> None:
        if isinstance(node, Node):
            node.end = parser.parser.CurrentByteIndex

    parser = bounded_parser(located, closed, longest_text=LONGEST_TEXT)
    try:
        if text is None:
            with path.open("rb") as file:
                content = file.read(LARGEST_FILE + 1)
        else:
            content = text.encode()
        if len(content) > LARGEST_FILE:
            raise ModelError(
                f"{path}: larger than {LARGEST_FILE // 2**20} MB, which no model is; give an .osim file."
            )
        parser.feed(content)
        root: Node = parser.close()
    except OSError as error:
        raise ModelError(f"{path}: cannot be read ({error.strerror}).") from error
    except XmlBoundsError as error:
        raise ModelError(
            f"{path}:{parser.parser.CurrentLineNumber}: {error}, which no model does; "
            "the file is damaged or not a model. Save it anew with OpenSim."
        ) from error
    except DefusedXmlException as error:
        raise ModelError(
            f"{path}: contains a document type or entity definition, which models never need; remove it."
        ) from error
    except ParseError as error:
        reason = str(error).split(":")[0]
        raise ModelError(
            f"{path}:{error.position[0]}: not well-formed XML ({reason}); "
            "the file is damaged or cut off. Export it again."
        ) from error
    except (ValueError, LookupError) as error:
        raise ModelError(f"{path}:1: cannot be decoded ({error}); save it as UTF-8.") from error
    return root, content


def property_text(value: object) -> str:
    """OpenSim's spelling of a property; numbers keep every digit."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    return " ".join(repr(float(number)) for number in np.atleast_1d(np.asarray(value, dtype=float)))


def _is_number(text: str) -> bool:
    try:
        return not math.isnan(float(text))
    except ValueError:
        return False


class XmlBoundsError(ValueError):
    """The document is larger or deeper than any that people make."""


class _BoundedTree(TreeBuilder):
    """Builds the tree, and stops where it grows beyond what people make."""

    def __init__(
        self,
        element_factory: Callable[[str, dict[str, str]], Element],
        closed: Callable[[Element], None],
        longest_text: int,
    ) -> None:
        super().__init__(element_factory=element_factory)
        self._closed, self._longest = closed, longest_text
        self._depth, self._parts, self._text = 0, 0, 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self._depth, self._parts, self._text = self._depth + 1, self._parts + 1 + len(attrs), 0
        if self._depth > DEEPEST:
            raise XmlBoundsError(f"elements lie more than {DEEPEST} deep within one another")
        if self._parts > MOST_PARTS:
            raise XmlBoundsError(f"it holds more than {MOST_PARTS} elements and attributes")
        return super().start(tag, attrs)

    def end(self, tag: str) -> Element:
        self._depth, self._text = self._depth - 1, 0
        element = super().end(tag)
        self._closed(element)
        return element

    def data(self, data: str) -> None:
        self._text += len(data)
        if self._text > self._longest:
            raise XmlBoundsError(f"an element holds more than {self._longest} characters")
        super().data(data)


def bounded_parser(
    element_factory: Callable[[str, dict[str, str]], Element] = Element,
    closed: Callable[[Element], None] = lambda _: None,
    *,
    longest_text: int,
) -> DefusedXMLParser:
    """A parser to feed, which raises `XmlBoundsError` or defusedxml's errors before memory or time is gone.

    Args:
        element_factory: makes an element of tag and attributes.
        closed: told of each element at its end.
        longest_text: characters that one element may hold.
    """
    return DefusedXMLParser(target=_BoundedTree(element_factory, closed, longest_text), forbid_dtd=True)


@dataclass(frozen=True)
class Placement:
    """A frame fixed on a body; `body` is "ground" for one that never moves."""

    body: str
    R: Float[np.ndarray, "3 3"]
    p: Float[np.ndarray, "3"]  # [m]

    def offset(self, translation: Float[np.ndarray, "3"], orientation: Float[np.ndarray, "3"]) -> "Placement":
        """The frame at that place in this one: translation [m], then body-fixed x-y-z angles [rad]."""
        return Placement(self.body, self.R @ body_fixed_xyz(orientation), self.p + self.R @ translation)


def origin(body: str) -> Placement:
    """A body's own frame."""
    return Placement(body, np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class JointPart:
    """A joint element, the frames it connects, and its coordinate elements in the file's order."""

    node: Node
    name: str
    parent: Placement
    child: Placement
    coordinates: tuple[Node, ...]


@dataclass(frozen=True)
class MarkerPart:
    """A marker element and the frame that carries it."""

    node: Node
    frame: Placement


@dataclass(frozen=True)
class ModelParts:
    """Bodies without the ground, and joints in the order in which OpenSim lists their coordinates."""

    bodies: tuple[Body, ...]
    joints: tuple[JointPart, ...]
    markers: tuple[MarkerPart, ...]
    notes: tuple[Note, ...] = ()


def body_of(
    document: OsimDocument, node: Node, inertia: Float[np.ndarray, "6"], geometry: tuple[Geometry, ...]
) -> Body:
    """A body from its element, its inertia xx yy zz xy xz yz about the centre of mass [kg·m²], and meshes."""
    mass = document.number(node, "mass")
    if mass < 0:
        raise document.error(node, f"its mass is {mass:g} kg; masses are zero or positive.")
    xx, yy, zz, xy, xz, yz = inertia if mass > 0 else np.zeros(6)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.diag(tensor).min() < 0 or np.linalg.eigvalsh(tensor)[0] < -ROUNDING * np.abs(tensor).max():
        raise document.error(
            node, "its inertia has a negative principal moment; correct its moments and products."
        )
    return Body(
        name=required_name(document, node),
        mass=mass,
        com_body=document.numbers(node, "mass_center", 3, default=(0.0, 0.0, 0.0)),
        inertia_body=tensor,
        geometry=geometry,
    )


def required_name(document: OsimDocument, node: Node) -> str:
    """The element's name attribute."""
    name = node.get("name", "")
    if not name:
        raise document.error(node, "it has no name; give it a name attribute.")
    return name
