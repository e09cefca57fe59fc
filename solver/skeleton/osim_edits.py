"""Changes of single properties in a model's file, which leave every other byte as it is."""

import re
from xml.sax.saxutils import escape

import numpy as np

from solver.skeleton.osim_document import Node, OsimDocument, children, property_text

ROUNDING = 1e-14  # relative, and of numbers in SI units
_START_TAG = re.compile(rb"<(?:[^\"'>]|\"[^\"]*\"|'[^']*')*>")


class OsimEdits:
    """What is to be different in a document's file; `content` makes the changes."""

    def __init__(self, document: OsimDocument) -> None:
        self._document = document
        self._texts: dict[int, tuple[Node, str]] = {}
        self._inserted: list[tuple[int, int, bytes]] = []  # place, rank among those of one place, text
        self._children: dict[int, tuple[Node, list[str]]] = {}

    def set(self, owner: Node, tag: str, value: object) -> None:
        """Give a property of an element this value, unless it has it; numbers keep every digit."""
        found = self._document.property(owner, tag)
        if found is not None and _same((found.text or "").split(), value):
            return
        own = next(iter(children(owner, tag)), None)
        if own is None:
            self.append(owner, f"<{tag}>{escape(property_text(value))}</{tag}>")
        else:
            self._texts[id(own)] = own, escape(property_text(value))

    def append(self, owner: Node, xml: str) -> None:
        """Add an element inside of another, before all else that it holds."""
        self._children.setdefault(id(owner), (owner, []))[1].append(xml)

    def surround(self, node: Node, before: str, after: str) -> None:
        """Put text before and behind an element."""
        self._inserted.append((node.start, 1, _bytes(before)))
        self._inserted.append((self._ends(node)[1], 0, _bytes(after)))

    def content(self) -> bytes:
        """The file's bytes with the changes made."""
        splices = [(place, place, rank, text) for place, rank, text in self._inserted]
        splices += [self._inside(node, text, anew=True) for node, text in self._texts.values()]
        for node, xml in self._children.values():
            splices.append(self._inside(node, self._indented(node, xml), anew=False))
        parts, done = [], 0
        for start, end, _, text in sorted(splices):
            parts += [self._document.content[done:start], text]
            done = end
        return b"".join((*parts, self._document.content[done:]))

    def _ends(self, node: Node) -> tuple[int, int]:
        """Where the element's first tag ends, and its last."""
        content = self._document.content
        first, last = (_START_TAG.match(content, place) for place in (node.start, node.end))
        if first is None:
            raise self._document.error(
                node, "its file is in no encoding that can be edited; save it as UTF-8."
            )
        return first.end(), node.end if _is_closed(first[0]) or last is None else last.end()

    def _inside(self, node: Node, text: str, *, anew: bool) -> tuple[int, int, int, bytes]:
        """Text in place of all that the element holds, or before it."""
        first, _ = self._ends(node)
        if _is_closed(self._document.content[node.start : first]):
            return first - 2, first, 0, _bytes(f">{text}</{node.tag}>")
        return first, node.end if anew else first, 0, _bytes(text)

    def _indented(self, node: Node, xml: list[str]) -> str:
        """Elements on lines of their own where the first that the element holds is on one."""
        first = self._ends(node)[0]
        space = re.match(rb"\s*", self._document.content[first:])
        return "".join((space[0].decode() if space else "") + one for one in xml)


def _bytes(text: str) -> bytes:
    return text.encode("ascii", "xmlcharrefreplace")  # the same in whatever encoding the file has


def _is_closed(tag: bytes) -> bool:
    return tag.endswith(b"/>")


def _same(words: list[str], value: object) -> bool:
    if isinstance(value, str | bool):
        return " ".join(words) == property_text(value)
    try:
        old, new = (np.atleast_1d(np.asarray(v, dtype=float)) for v in (words, value))
        return old.shape == new.shape and np.allclose(old, new, rtol=ROUNDING, atol=ROUNDING)
    except ValueError:
        return False
