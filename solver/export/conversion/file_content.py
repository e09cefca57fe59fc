"""What a file holds, whatever its format: the middle between every reader and every writer."""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import FootEvent, ForcePlate, Markers
from solver.capture.formats.analog_channels import AnalogChannels
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


class Part(StrEnum):
    """What a file may hold, in the words of messages."""

    MARKERS = "markers"
    PLATES = "force plates"
    ANALOG = "analog channels"
    EVENTS = "gait events"
    MODEL = "model"
    MOTION = "motion"
    TORQUES = "joint torques"
    CONTACTS = "forces on bodies"
    PERSON = "mass and height"


@dataclass(frozen=True)
class BodyForces:
    """What the ground does to bodies of the model, at the motion's frames."""

    bodies: tuple[str, ...]
    wrench_ground: Float[np.ndarray, "frames bodies 6"]  # force [N], moment about the ground origin [N·m]
    cop_ground: Float[np.ndarray, "frames bodies 3"]  # [m] NaN while unloaded


@dataclass(frozen=True)
class Trial:
    """One trial: ground frame, y up, SI; forces on the person."""

    name: str
    markers: Markers | None = None
    plates: tuple[ForcePlate, ...] = ()
    events: tuple[FootEvent, ...] = ()
    motion: Motion | None = None  # of the model's free coordinates
    torques: Float[np.ndarray, "frames dofs"] | None = None  # generalized forces at the motion's frames
    contacts: BodyForces | None = None
    analog: AnalogChannels | None = None  # what is no force plate's


@dataclass(frozen=True)
class Content:
    """All that was read of a file, or of files that belong together."""

    source: Path
    trials: tuple[Trial, ...]
    skeleton: Skeleton | None = None
    model_text: str | None = None  # the model as its file has it, muscles and all
    mass_kg: float | None = None
    height_m: float | None = None
    left_behind: tuple[str, ...] = field(default=())  # what the file holds and nothing here takes
    notes: tuple[str, ...] = ()

    def parts(self) -> frozenset[Part]:
        """What there is of it in any trial."""
        there = {
            Part.MARKERS: any(t.markers is not None for t in self.trials),
            Part.PLATES: any(t.plates for t in self.trials),
            Part.ANALOG: any(t.analog is not None for t in self.trials),
            Part.EVENTS: any(t.events for t in self.trials),
            Part.MODEL: self.skeleton is not None,
            Part.MOTION: any(t.motion is not None for t in self.trials),
            Part.TORQUES: any(t.torques is not None for t in self.trials),
            Part.CONTACTS: any(t.contacts is not None for t in self.trials),
            Part.PERSON: self.mass_kg is not None or self.height_m is not None,
        }
        return frozenset(part for part, is_there in there.items() if is_there)

    def of(self, trials: Collection[Trial]) -> "Content":
        """The same of some of its trials."""
        return replace(self, trials=tuple(trials))
