"""Trials of a B3D file that are made each time they are asked for: memory holds one of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import overload

from solver.capture.formats.b3d.schema import B3dTrial


@dataclass(frozen=True)
class TrialsOnDemand(Sequence[B3dTrial]):
    """In order."""

    makers: tuple[Callable[[], B3dTrial], ...]

    def __len__(self) -> int:
        return len(self.makers)

    @overload
    def __getitem__(self, index: int) -> B3dTrial: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[B3dTrial]: ...

    def __getitem__(self, index: int | slice) -> B3dTrial | Sequence[B3dTrial]:
        if isinstance(index, slice):
            return TrialsOnDemand(self.makers[index])
        return self.makers[index]()
