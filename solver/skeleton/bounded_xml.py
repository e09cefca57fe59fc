"""XML from untrusted sources: neither document types nor entities, and bounds on what is in it."""

from collections.abc import Callable
from xml.etree.ElementTree import Element, TreeBuilder

from defusedxml.ElementTree import DefusedXMLParser

DEEPEST = (
    200  # elements within one another; OpenSim's models have 20, and far deeper ones crash Python itself
)
MOST_PARTS = 1_000_000  # elements and attributes; the largest published models have a tenth of it


class XmlBoundsError(ValueError):
    """The document is larger or deeper than any that people make."""


class _BoundedTree(TreeBuilder):
    """Builds the tree, and stops where it grows beyond what people make."""

    def __init__(self, element_factory: Callable[[str, dict[str, str]], Element], longest_text: int) -> None:
        super().__init__(element_factory=element_factory)
        self._longest, self._depth, self._parts, self._text = longest_text, 0, 0, 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self._depth, self._parts, self._text = self._depth + 1, self._parts + 1 + len(attrs), 0
        if self._depth > DEEPEST:
            raise XmlBoundsError(f"elements lie more than {DEEPEST} deep within one another")
        if self._parts > MOST_PARTS:
            raise XmlBoundsError(f"it holds more than {MOST_PARTS} elements and attributes")
        return super().start(tag, attrs)

    def end(self, tag: str) -> Element:
        self._depth, self._text = self._depth - 1, 0
        return super().end(tag)

    def data(self, data: str) -> None:
        self._text += len(data)
        if self._text > self._longest:
            raise XmlBoundsError(f"an element holds more than {self._longest} characters")
        super().data(data)


def bounded_parser(
    element_factory: Callable[[str, dict[str, str]], Element] = Element, *, longest_text: int
) -> DefusedXMLParser:
    """A parser to feed, which raises `XmlBoundsError` or defusedxml's errors before memory or time is gone.

    Args:
        element_factory: makes an element of tag and attributes.
        longest_text: characters that one element may hold.
    """
    return DefusedXMLParser(target=_BoundedTree(element_factory, longest_text), forbid_dtd=True)
