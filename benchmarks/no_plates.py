"""Forces predicted without any plate, judged by those that plates recorded: `python -m benchmarks.no_plates`.

Every recording of `benchmarks.truth.recorded` is fitted to its markers alone. Forces are predicted from
the motion and the mass that its plates read (that is what "mass given" means), at several cut-offs, and held
against the recorded ones on frames on which every foot's force counts. The one cut-off of all recordings is
chosen on one half of the people and judged on the other, and the other way round; what is used
is printed beside it. Writes NO_PLATES.md.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from solver.capture.subject.subject import open_subject
from solver.contact.wrenches import FrameMask
from solver.dynamics.com_data import com_data
from solver.dynamics.force_prediction.unmeasured_forces import unmeasured_forces
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.root_wrench import about_point
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.fitting.torques_stage import filtered
from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import unseen_mass_notes
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

PAGE = Path(__file__).with_name("NO_PLATES.md")
CUTOFFS_HZ = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0)
PLAIN_HZ = 6.0  # what laboratories filter walking with
FEWEST_FRAMES = 20  # that judge


@dataclass(frozen=True)
class Row:
    """One trial; errors are RMS of the total force over the mass [N/kg]."""

    folder: str
    trial: str
    activity: str
    unseen: bool  # some of the body's mass carries no marker
    plain: float  # the motion low-passed at `PLAIN_HZ`, nothing else
    ours: Mapping[float, float]  # by cut-off [Hz]


def rows() -> Iterator[Row]:
    """Every trial of the bench's recordings with enough counted frames."""
    settings = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
    for folder, activities in ACTIVITY.items():
        fit = solve(open_subject(data_folder() / folder), settings, trials=list(activities))
        for trial in fit.trials:
            row = _row(folder, activities[trial.capture.name], trial, fit, settings)
            if row is not None:
                print(row, flush=True)
                yield row


def _row(folder: str, activity: str, trial: TrialFit, fit: Fit, settings: Settings) -> Row | None:
    assert trial.contacts is not None
    assert trial.mask is not None
    assert fit.groundwork is not None
    judged = inverse_dynamics(fit.skeleton, trial.motion, trial.contacts, trial.mask, settings.dynamics).used
    own = mass_from_forces([com_data(fit.skeleton, trial.motion, trial.contacts, trial.mask)], settings.com)
    if judged.sum() < FEWEST_FRAMES or own is None:
        return None
    skeleton = with_mass(fit.skeleton, own.mass_kg)
    demand, com = _demand(trial, filtered(trial.motion, settings), skeleton, settings)
    recorded = trial.contacts.wrench_ground[:, :, :3].sum(axis=1)

    def missed(wrench: Float[np.ndarray, "frames 6"]) -> float:
        return _rms(wrench[:, :3] - recorded, judged) / skeleton.mass

    match, rate = fit.groundwork.match, trial.motion.rate
    return Row(
        folder,
        trial.capture.name,
        activity,
        bool(unseen_mass_notes(match.skeleton(skeleton), match.observed(trial.capture.markers))),
        missed(_demand(trial, trial.motion.low_passed(PLAIN_HZ), skeleton, settings)[0]),
        {hz: missed(unmeasured_forces(demand, com, rate, hz).wrench_ground) for hz in CUTOFFS_HZ},
    )


def _demand(
    trial: TrialFit, motion: Motion, skeleton: Skeleton, settings: Settings
) -> tuple[Float[np.ndarray, "frames 6"], Float[np.ndarray, "frames 3"]]:
    """What a motion demands of the ground [N, N·m about the ground origin], and the centre of mass [m]."""
    assert trial.contacts is not None
    assert trial.mask is not None
    nothing = FrameMask(np.zeros_like(trial.mask.counts))
    dynamics = inverse_dynamics(skeleton, motion, trial.contacts, nothing, settings.dynamics)
    return about_point(dynamics.residual_root, -dynamics.root_ground), dynamics.com_ground


def _rms(values: Float[np.ndarray, "frames 3"], of: Bool[np.ndarray, " frames"]) -> float:
    return float(np.sqrt((values[of] ** 2).sum(axis=1).mean()))


def best_cutoff(of: list[Row]) -> float:
    """The one with the least geometric mean of errors."""
    return min(CUTOFFS_HZ, key=lambda hz: float(np.mean([np.log(row.ours[hz]) for row in of])))


def page(of: list[Row]) -> str:
    """The table, and the halves."""
    ours_Hz = Settings().dynamics.unmeasured_cutoff_Hz
    lines = [
        "# Forces without plates",
        "",
        "Made by `python -m benchmarks.no_plates`. Total force predicted from the markers' motion and the "
        "mass, against the recorded one: RMS over frames whose forces count, N/kg. The mass is what the "
        f"trial's own plates read. *Plain*: the motion low-passed at {PLAIN_HZ:g} Hz, nothing else. The "
        "others: smooth momentum, and no force in flight "
        "([dynamics.md](../docs/dynamics.md#no-force-at-all-unmeasured_forcespy)). "
        "Bold: the cut-off that is used. † some of the body's mass carries no marker.",
        "",
        f"| recording | trial | activity | plain | {' | '.join(f'{hz:g} Hz' for hz in CUTOFFS_HZ)} |",
        f"|---|---|---|{'---|' * (len(CUTOFFS_HZ) + 1)}",
    ]
    for row in of:
        cells = [f"**{e:.2f}**" if hz == ours_Hz else f"{e:.2f}" for hz, e in row.ours.items()]
        mark = " †" if row.unseen else ""
        lines.append(
            f"| {row.folder}{mark} | {row.trial} | {row.activity} | {row.plain:.2f} | {' | '.join(cells)} |"
        )
    lines += ["", *_walks(of, ours_Hz), "", *_halves(of, ours_Hz), ""]
    return "\n".join(lines)


def _walks(of: list[Row], hz: float) -> Iterator[str]:
    walks = [row for row in of if row.activity == "walk" and not row.unseen]
    errors = [row.ours[hz] for row in walks]
    plain = [row.plain for row in walks]
    yield (
        f"Full-body walks ({len(walks)}): mean {np.mean(errors):.2f}, worst {max(errors):.2f} N/kg "
        f"(plain {np.mean(plain):.2f} and {max(plain):.2f})."
    )


def _halves(of: list[Row], used_Hz: float) -> Iterator[str]:
    """People in the order of their folders, every other one in a half."""
    people = list(dict.fromkeys(row.folder for row in of))
    halves = [[row for row in of if row.folder in people[k::2]] for k in (0, 1)]
    for name, chosen, judge in (("first", halves[0], halves[1]), ("second", halves[1], halves[0])):
        hz = best_cutoff(chosen)
        yield (
            f"- Chosen on the {name} half of the people: {hz:g} Hz. On the other half, geometric mean over "
            f"plain {PLAIN_HZ:g} Hz: {_against_plain(judge, hz):.3f}; {used_Hz:g} Hz: "
            f"{_against_plain(judge, used_Hz):.3f}."
        )


def _against_plain(of: list[Row], hz: float) -> float:
    return float(np.exp(np.mean([np.log(row.ours[hz] / row.plain) for row in of])))


if __name__ == "__main__":
    PAGE.write_text(page(list(rows())))
