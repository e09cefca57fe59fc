"""What was computed and may be asked for again, within so many bytes: the longest unused goes first."""

from collections import OrderedDict
from collections.abc import Callable
from typing import TypeVar, cast

Value = TypeVar("Value")
Key = tuple[str | int, ...]


class Memory:
    """Values by what they are and the objects that they were made of, which live as long as they are kept."""

    def __init__(self, most_bytes: float) -> None:
        self.most_bytes = most_bytes
        self.bytes = 0  # that are taken
        self._of: OrderedDict[Key, tuple[tuple[object, ...], object, int]] = OrderedDict()

    def has(self, what: str, *of: object) -> bool:
        """Whether it is there."""
        return _key(what, of) in self._of

    def get(self, make: Callable[[], Value], what: str, *of: object) -> Value:
        """What was made of these objects, which are told apart by identity; made now if it isn't there."""
        key = _key(what, of)
        if key in self._of:
            self._of.move_to_end(key)
            return cast(Value, self._of[key][1])
        value = make()
        self.put(value, what, *of)
        return value

    def put(self, value: object, what: str, *of: object) -> None:
        """A value that was made together with others.

        Args:
            value: an array, tuples of arrays and of None, or something that tells its `nbytes`.
            what: it is.
            of: what it was made of.
        """
        key, size = _key(what, of), _bytes(value)
        if key in self._of:
            self.bytes -= self._of.pop(key)[2]
        self._of[key] = of, value, size
        self.bytes += size
        while self.bytes > self.most_bytes and len(self._of) > 1:
            _, (_, _, freed) = self._of.popitem(last=False)
            self.bytes -= freed


def _bytes(value: object) -> int:
    return sum(map(_bytes, value)) if isinstance(value, tuple) else int(getattr(value, "nbytes", 0))


def _key(what: str, of: tuple[object, ...]) -> Key:
    return (what, *map(id, of))
