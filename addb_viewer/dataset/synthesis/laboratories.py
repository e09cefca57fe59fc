"""Where a synthetic corpus comes from: terms, cameras, plates and markers of each source."""

from collections.abc import Sequence
from dataclasses import dataclass

from solver.simulate.demo import MARKERS, STATIC_MARKERS

ARMS = ("SHO", "UPA", "ELB", "ELM", "FRM", "WRA", "WRB", "FIN")


@dataclass(frozen=True)
class Laboratory:
    """A source of recordings."""

    source: str
    licence: str
    marker_rate: float  # [Hz]
    force_rate: float  # [Hz]
    activities: tuple[str, ...]
    plates: int | None = None  # along the walkway; None: one under every step
    treadmill: bool = False
    arms: bool = True  # whether people wear markers on them
    prefix: str = ""  # of every marker's label

    def markers(self, *, static: bool = False) -> tuple[str, ...]:
        """Which of the body's markers people wear here."""
        names = STATIC_MARKERS if static else MARKERS
        return tuple(name for name in names if self.arms or name[1:] not in ARMS)

    def labels(self, names: Sequence[str]) -> tuple[str, ...]:
        """As the files have them."""
        return tuple(self.prefix + name for name in names)


LABORATORIES = (
    Laboratory("Aare 2019", "CC-BY-4.0", 100.0, 1000.0, ("walk", "squat")),
    Laboratory("Brook 2021", "CC0-1.0", 120.0, 1200.0, ("walk", "run"), treadmill=True, arms=False),
    Laboratory("Cove 2016", "CC-BY-SA-4.0", 60.0, 600.0, ("walk", "stand"), plates=3, prefix="subject:"),
    Laboratory("Dale 2023", "LicenseRef-Dale", 200.0, 2000.0, ("run", "squat", "landing")),
)
