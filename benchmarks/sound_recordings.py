"""Scatters of the direct checks, as sound recordings show them, beside those that are used.

`python -m benchmarks.sound_recordings` reads plates and markers, fits nothing, and prints a table. A level
stands if it is remade within the scatter that is used with it, a scatter within a factor of 1.5. Scatters are
robust (1.48 times the median size): they are scales of Student's t, and not all of these recordings are sound
in every way. They are read from folders as laboratories left them too, of which nobody says that something is
wrong; each person counts once, and is left out once.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from benchmarks.zoo.truth import read_truth
from solver.capture.subject.opened_subject import open_subject, subjects_in
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError
from solver.diagnosis.direct_checks import lag as timing
from solver.diagnosis.direct_checks import pressure_path, rigid_distances, weight
from solver.diagnosis.direct_checks.measured import Measured, measure_trials
from solver.diagnosis.direct_checks.run_checks import run_checks
from solver.diagnosis.direct_checks.statement import Statement
from solver.fitting.settings import Settings

FACTOR = 1.5  # by which a scatter may be remade otherwise
ROBUST = 1.4826  # standard deviations of a Gaussian in its median size
PLANE = 1 / np.sqrt(2 * np.log(2))  # and of a Gaussian in a plane, those of each coordinate
NOT_SOUND = {  # files that hold something: what they carry is no scatter
    ("exo_apo_gordon", "ET21"): "a device of 7 kg is worn",
    ("overground_camargo2021_AB06", "levelground_ccw_fast_01_01"): "feet beside the plates, 30 kg",
}


@dataclass(frozen=True)
class Figure:
    """One number of the solver, and the same remade."""

    name: str
    used: float
    remade: float
    of: int  # trials, or what each tells
    what: str
    people: int
    left_out: tuple[float, float]  # least and most, remade without one person
    within: float | None = None  # of a level: the scatter that is used with it

    @property
    def stands(self) -> bool:
        """Whether it is about what sound recordings show."""
        if self.within is not None:
            return abs(self.remade - self.used) < self.within
        return bool(1 / FACTOR < self.remade / self.used < FACTOR)


@dataclass(frozen=True, eq=False)
class Recorded:
    """The trials of a person whose activity is known."""

    folder: str
    activities: dict[str, str]  # empty: unknown
    trials: list[Measured]
    mass_kg: float | None  # as a laboratory stated it


def recorded() -> Iterator[Recorded]:
    """All of the bench, folder by folder."""
    reading = Settings().reading
    for folder, activities in ACTIVITY.items():
        subject = open_subject(data_folder() / folder)
        chosen = [files for files in subject.trials if files.name in activities]
        trials = [Measured(read_trial(files, reading), reading) for files in chosen]
        yield Recorded(folder, activities, trials, subject.mass_kg)


def as_found() -> Iterator[Recorded]:
    """Folders as laboratories left them, of one person with forces, without trials with a known fault."""
    reading = Settings().reading
    for file in sorted((data_folder() / "wild" / "truth").glob("*.toml")):
        truth = read_truth(file)
        if truth.usable != "torques" or truth.persons != 1 or truth.not_body or truth.extra_forces:
            continue
        faulty = {t.name for t in truth.trials if t.plates_dead or t.partly or t.force_offset_ms}
        try:
            subjects, _ = subjects_in(data_folder() / "wild" / file.stem)
            for subject in subjects:
                chosen = [f for f in subject.trials if not {f.name, f.markers.stem} & faulty]
                captures = [read_trial(files, reading, subject.mass_kg) for files in chosen]
                yield Recorded(file.stem, {}, measure_trials(captures, reading), subject.mass_kg)
        except CaptureError as error:
            print(f"{file.stem}: left out: {error}")


def of_direct_checks(people: Sequence[Recorded]) -> list[Figure]:
    """What the direct checks of a diagnosis measure, in walks and runs where time or weight matters."""
    said = [
        (
            person,
            run_checks(
                [t for t in person.trials if (person.folder, t.capture.name) not in NOT_SOUND], person.mass_kg
            ),
        )
        for person in people
    ]
    everything = [of for _, of in said]
    moving = [
        [
            one
            for one in of
            if not person.activities or person.activities.get(one.trial or "") in ("walk", "run")
        ]
        for person, of in said
    ]
    masses = [
        [
            float(np.log(one.figures["carried_kg"] / one.figures["entered_kg"]))
            for one in of
            if "entered_kg" in one.figures
        ]
        for of in moving
    ]
    alone = [[ratio for one in of for ratio in _between_plates(one)] for of in moving]
    lags = [
        [lag + timing.LAG_BIAS_S for lag in _told(of, "lag", "lag_s")] for of in moving
    ]  # its own is taken off
    bias_s = usual(lags)
    paths = [_told(of, "path of the pressure", "scatter_m") for of in everything]
    places = [_told(of, "path of the pressure", "off_m") for of in everything]
    own = usual([_told(of, "path of the pressure", "std_m") for of in everything])
    lengths = [_told(of, "rigid distances", "scatter") for of in everything]
    about = [[lag - bias_s for lag in of] for of in lags]
    return [
        _scatter("MASS_SCATTER", weight.MASS_SCATTER, masses, "carried over entered mass, logarithm"),
        _scatter("PLATES_SCATTER", weight.PLATES_SCATTER, alone, "mass on one plate over that on the others"),
        _figure(
            "LAG_BIAS_S",
            timing.LAG_BIAS_S,
            lags,
            "forces after motion",
            remade=usual,
            within=timing.LAG_SCATTER_S,
        ),
        _scatter("LAG_SCATTER_S", timing.LAG_SCATTER_S, about, "about that"),
        _figure(
            "PATH_SCATTER_M",
            pressure_path.PATH_SCATTER_M,
            paths,
            "pressure about the pressing markers, each plate's root mean square",
            remade=usual,
        ),
        _figure(
            "PLACE_SCATTER_M",
            pressure_path.PLACE_SCATTER_M,
            places,
            "middle of the stances on a plate, each coordinate, beyond what few stances leave open",
            remade=lambda of: float(np.sqrt((PLANE * usual(of)) ** 2 - own**2)),
        ),
        _scatter(
            "BETWEEN_SCATTER",
            rigid_distances.BETWEEN_SCATTER,
            lengths,
            "lengths from trial to trial, logarithm",
        ),
    ]


def _told(said: Sequence[Statement], direct_check: str, figure: str) -> list[float]:
    return [one.figures[figure] for one in said if one.direct_check == direct_check and figure in one.figures]


def _between_plates(said: Statement) -> Iterator[float]:
    """Of masses that plates carry alone, each over the median of the others, logarithm."""
    masses = {plate: kg for plate, kg in said.figures.items() if plate.startswith("plate_")}
    for plate, kg in masses.items() if said.direct_check == "weight" else ():
        yield float(np.log(kg / np.median([other for name, other in masses.items() if name != plate])))


def usual(by_person: Sequence[Sequence[float]]) -> float:
    """The middle of all values, of which each person's count as one together."""
    some = [own for own in by_person if len(own)]
    values = np.concatenate([np.asarray(own) for own in some])
    weights = np.concatenate([np.full(len(own), 1 / len(own)) for own in some])
    order = np.argsort(values)
    below = (np.cumsum(weights[order]) - 0.5 * weights[order]) / weights.sum()
    return float(np.interp(0.5, below, values[order]))


def _robust(by_person: Sequence[Sequence[float]]) -> float:
    return ROBUST * usual([np.abs(own).tolist() for own in by_person])


def _scatter(name: str, used: float, by_person: Sequence[Sequence[float]], what: str) -> Figure:
    """About nothing, robustly."""
    return _figure(name, used, by_person, what, remade=_robust)


def _figure(
    name: str,
    used: float,
    by_person: Sequence[Sequence[float]],
    what: str,
    *,
    remade: Callable[[Sequence[Sequence[float]]], float],
    within: float | None = None,
) -> Figure:
    some = [own for own in by_person if len(own)]
    without = [remade([*some[:k], *some[k + 1 :]]) for k in range(len(some))] if len(some) > 1 else [np.nan]
    spread = (float(min(without)), float(max(without)))
    return Figure(name, used, remade(some), sum(map(len, some)), what, len(some), spread, within)


def table(figures: Sequence[Figure]) -> str:
    """As Markdown."""
    lines = ["| figure | | used | remade (one person left out) | of | |", "|---|---|---:|---:|---:|---|"]
    lines += [
        f"| `{one.name}` | {'stands' if one.stands else 'asks for a look'} | {one.used:.3g} | "
        f"{one.remade:.3g} ({one.left_out[0]:.3g} to {one.left_out[1]:.3g}, {one.people} people) | "
        f"{one.of} | {one.what} |"
        for one in figures
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(of_direct_checks([*recorded(), *as_found()])))
