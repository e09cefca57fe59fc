"""The range of frames that keys act on: from I to O, or dragged."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Selection:
    """Marks of a range; None where a border has not been set."""

    start: int | None = None
    end: int | None = None  # the first frame after it
    spent_at: int | None = None  # frame at which it was painted: it holds until the cursor moves on

    def with_start(self, frame: int) -> "Selection":
        """I: the range begins at a frame. An end before it becomes the start; of a whole range it goes."""
        end = self.end if self.spent_at is None else None
        if end is None or end > frame:
            return Selection(frame, end)
        return Selection(end - 1, frame + 1) if self.start is None else Selection(frame)

    def with_end(self, frame: int) -> "Selection":
        """O: the range ends with a frame. A start after it becomes the end; of a whole range it goes."""
        start = self.start if self.spent_at is None else None
        if start is None or start <= frame:
            return Selection(start, frame + 1)
        return Selection(frame, start + 1) if self.end is None else Selection(None, frame + 1)

    @property
    def is_whole(self) -> bool:
        """Whether both borders are set."""
        return self.start is not None and self.end is not None

    def spent(self, frame: int) -> "Selection":
        """After it was painted at a frame: another key may still repaint it there."""
        return replace(self, spent_at=frame)

    def seen_from(self, frame: int) -> "Selection":
        """What is left of it when the cursor is at a frame."""
        return Selection() if self.spent_at is not None and self.spent_at != frame else self

    def frames(self, cursor: int, frames: int) -> tuple[int, int] | None:
        """The range, an open one up to the cursor; None where nothing is selected.

        Args:
            cursor: the present frame.
            frames: of the trial.
        """
        if self.start is None and self.end is None:
            return None
        start = min(self.start, cursor) if self.start is not None and self.end is None else self.start
        end = self.end if self.end is not None else max(self.start or 0, cursor) + 1
        first = (min(cursor, end - 1) if cursor < end else end - 1) if start is None else start
        return max(first, 0), min(end, frames)
