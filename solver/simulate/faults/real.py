"""Effects put into real recordings: each case with its counterpart, the same recording as it is."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver.simulate.faults.cases import write_truth
from solver.simulate.faults.draw_measurement import MEASUREMENT, hide_measurement
from solver.simulate.faults.drawing import NoPlaceError
from solver.simulate.faults.emulated import EMULATED, hide_emulated
from solver.simulate.faults.files import Recording, read_recording, write_recording
from solver.simulate.faults.hidden import UNSIZED, Hidden, Truth

IDS = (*MEASUREMENT, *EMULATED)
# Recordings whose plates bear all steps for at least a cycle; folder, trial.
SOUND = (
    ("walk_gait2354_subject01", "walk1"),
    ("walk_treadmill_stepwidth", "example1"),
    ("run_treadmill_hamner2013_subject04", "run400"),
    ("opencap_subject4", "squats1"),
    ("opencap_subject4", "walking1"),
    ("opencap_subject6", "walking1"),
    ("exo_apo_gordon", "NE21"),
)
NEEDS_WEIGHT = (
    "plate_gain",
    "body_weight_support",
    "carried_mass",
)  # otherwise it is build
TRIES = 8


@dataclass(frozen=True)
class RealCase:
    """One effect in one recording."""

    name: str
    folder: str
    trial: str
    id: str
    size: float
    seed: int

    @property
    def counterpart(self) -> str:
        """Name of the same recording without the effect."""
        return f"{self.folder}__{self.trial}"


def plan_real(seed: int, cases: int, sizes: tuple[float, ...], ids: tuple[str, ...] = IDS) -> list[RealCase]:
    """Recordings and ids in turn, sizes drawn."""
    rng = np.random.default_rng(seed)
    places, effects = _round(len(SOUND), rng), _round(len(ids), rng)
    plans = []
    for n in range(cases):
        folder, trial = SOUND[next(places)]
        id = ids[next(effects)]
        size = 1.0 if id in UNSIZED else float(rng.choice(sizes))
        plans.append(RealCase(f"real_{n:04d}", folder, trial, id, size, int(rng.integers(2**31))))
    return plans


def hidden_in(recording: Recording, case: RealCase) -> tuple[Recording, Hidden]:
    """The recording with the effect.

    Raises:
        NoPlaceError: this recording has no place for it.
    """
    if case.id in NEEDS_WEIGHT and recording.mass_kg is None:
        raise NoPlaceError("no mass entered")
    rng = np.random.default_rng(case.seed)
    reason = NoPlaceError(case.id)
    for _ in range(TRIES):
        try:
            if case.id in MEASUREMENT:
                return hide_measurement(recording, case.id, case.size, rng)
            return hide_emulated(recording, case.id, case.size, rng)
        except NoPlaceError as why:
            reason = why
    raise reason


def write_real(out: Path, data: Path, case: RealCase) -> bool:
    """Write the case and, once, its counterpart; False where the recording has no place for the effect."""
    if (out / "truth" / f"{case.name}.json").exists():
        return True
    recording = read_recording(data / case.folder, (case.trial,))
    try:
        changed, hidden = hidden_in(recording, case)
    except NoPlaceError:
        return False
    counterpart = out / "subjects" / case.counterpart
    if not counterpart.exists():
        write_recording(counterpart, recording)
        write_truth(out, Truth(case.counterpart, "real", (), {"recording": case.folder}))
    write_recording(out / "subjects" / case.name, changed)
    write_truth(
        out,
        Truth(
            case.name, "real", (hidden,), {"recording": case.folder, "trial": case.trial}, case.counterpart
        ),
    )
    return True


def _round(count: int, rng: np.random.Generator) -> Iterator[int]:
    while True:
        yield from rng.permutation(count).tolist()
