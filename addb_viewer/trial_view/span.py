"""The stretch of a trial that the timeline shows."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Span:
    """Frames `first` to `last`, both shown."""

    first: int
    last: int

    def share(self, frame: float) -> float:
        """Where a frame lies: 0 at the left border, 1 at the right one."""
        return (frame - self.first) / max(self.last - self.first, 1)

    def block(self, start: int, end: int) -> tuple[float, float] | None:
        """Left border and width of frames start to end − 1 as shares; None where none of them is shown."""
        left, right = max(self.share(start - 0.5), 0.0), min(self.share(end - 0.5), 1.0)
        return (left, right - left) if right > left else None
