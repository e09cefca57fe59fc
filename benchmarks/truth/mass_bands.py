"""Whether bands of masses hold them: simulated people whose segments weigh otherwise than tables say.

`python -m benchmarks.truth.mass_bands` prints a row a person, activity and model. Nothing of these people set
the bands: their width comes from each fit's own border and from people's scatter about tables.
"""

import tempfile
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.truth import simulated
from benchmarks.truth.bands import SIDES_SD
from solver.fitting.fit_result import Fit
from solver.skeleton.skeleton import Skeleton

ACTIVITIES = ("walk", "run", "squat", "landing")
MODELS = ((True, 3.0), (True, 10.0), (False, 3.0), (False, 10.0))  # the person's own; skin [mm]


def off_in_bands(fit: Fit, true: Skeleton) -> dict[str, tuple[float, float, float]]:
    """By segment and of the body: error over the true mass, half widths of its band and of that of tables."""
    assert fit.mass_std is not None
    masses = {body.name: body.mass for body in true.bodies}
    stds = zip(fit.skeleton.bodies, fit.mass_std.segments_kg, fit.mass_std.untold_kg, strict=True)
    told = {
        body.name: (body.mass / mass - 1, SIDES_SD * std / mass, SIDES_SD * untold / mass)
        for body, std, untold in stds
        if (mass := masses.get(body.name, 0.0)) and not body.name.endswith("_l")  # left as right
    }
    whole = SIDES_SD * fit.mass_std.body_kg / true.mass
    return told | {"body": (fit.skeleton.mass / true.mass - 1, whole, np.nan)}


def main() -> None:
    """Print rows, then the shares that bands hold."""
    held: dict[str, list[bool]] = {}
    for activity, person, (own, skin) in product(ACTIVITIES, range(simulated.PERSONS), MODELS):
        truth = simulated.made(activity, person)
        with tempfile.TemporaryDirectory() as scratch:
            fit = simulated.solved(truth, activity, person, Path(scratch) / "s", own=own, skin_mm=skin)
        found = off_in_bands(fit, truth.trial.body.skeleton)
        words = (f"{n} {100 * e:+.1f} ± {100 * b:.1f} ({100 * t:.1f})" for n, (e, b, t) in found.items())
        print(
            f"{activity} {person} {'own' if own else 'default'} {skin:g} mm: {'; '.join(words)}", flush=True
        )
        for name, (error, band, _) in found.items():
            held.setdefault(name, []).append(abs(error) < band)
    print("; ".join(f"{name} {sum(each)} of {len(each)}" for name, each in held.items()))


if __name__ == "__main__":
    main()
