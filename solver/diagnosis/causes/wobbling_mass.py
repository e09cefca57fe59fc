"""Wobbling mass: part of a segment swings beside its bone, which the markers do not show."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from solver.common.filters import low_pass
from solver.diagnosis.causes.about import About, AtFault, Ball, Entry, Named, Reading
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Nonlinear, Signature
from solver.diagnosis.causes.observed_trial import Scene
from solver.skeleton.forward import cross

LIGHTEST_SHARE = 0.04  # of body mass, of a segment with soft tissue that counts: a shank is
PRIOR_STD_KG = 4.0
LEAST_KG = 1.0
FREQUENCIES_HZ = (1.5, 15.0)
DAMPING = (0.02, 1.5)
DRIVEN_BELOW_HZ = 8.0  # above, accelerations are markers' noise, and a signature that shares it explains it
FINER_HZ = 400.0  # steps of the equation of motion
CRITICAL = 1e-6  # both roots are one at critical damping; kept apart by so much
KEPT = 64  # segments of a session's trials
TRANSIENT_M_PER_S2 = 1.5  # a push that could have set it swinging before the recording begins


@dataclass(frozen=True)
class WobblingMass(Candidate):
    """A mass m at the segment's centre of mass hangs on a spring and a damper, alike in all directions.

    Its way r from there obeys r̈ + 2ζω ṙ + ω² r = −p̈. The model has it fixed: what a fixed mass demands less
    what the swinging one demands acts like an external wrench, −m r̈ at p and −r × m(p̈ + r̈ − g). η: frequency
    and damping ratio; m acts linearly. Six more columns let it swing already when the recording begins.
    """

    about = About(
        id="wobbling_mass",
        entry=Entry(
            "body",
            "a share of the segment hangs on a spring and a damper",
            "`mass_kg`, `frequency_Hz`, `damping_ratio`",
        ),
        title="wobbling soft tissue: {target}",
        sentence="Soft tissue of {target} swings on its own, and the markers do not show it.",
        remedy="Strap it, or state which share of the segment swings, and at which frequency.",
        separate_by="a hop or a heel drop, after which the swing dies out",
        branch="body/soft_tissue",
        names=Named.BODIES,
        at_fault=AtFault.MODEL,
        odds_against=13.0,
        readings=(
            Reading("mass_kg", "{amount} swing", "kg"),
            Reading("frequency_Hz", "at {amount}", "Hz"),
            Reading("damping_ratio", "with a damping ratio of {amount}", ""),
        ),
        picture=Ball("mass_kg"),
    )
    parameters = ("mass_kg",)
    nonlinear = (  # what abdomen, thigh and calf do
        Nonlinear("frequency_Hz", (3.0, 5.0, 8.0), step=0.8, bounds=FREQUENCIES_HZ, prior=(5.0, 2.5)),
        Nonlinear("damping_ratio", (0.2,), step=0.08, bounds=DAMPING, prior=(0.25, 0.2)),
    )

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """A kilogramme that swings from rest, and six ways to swing from the beginning."""
        if self.target not in scene.skeleton.body_names:
            return None
        soft_tissue = _soft_tissue(scene, scene.skeleton.body_index(self.target))
        r, r_dd = _driven(soft_tissue.push_fine, scene.rate, eta)
        moment = soft_tissue.moment_still - cross(soft_tissue.place + r, soft_tissue.felt + r_dd)
        driven = np.concatenate([-r_dd, moment], axis=1)[:, :, None]
        columns = np.concatenate([driven, _free(soft_tissue, scene, eta)], axis=2)
        return Signature(columns, np.full(7, PRIOR_STD_KG))

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """Soft tissue that swings slower or faster, or goes on by itself, is no soft tissue."""
        eta = estimates["frequency_Hz"], estimates["damping_ratio"]
        return all(
            low - e.std <= e.value <= high + e.std
            for e, (low, high) in zip(eta, (FREQUENCIES_HZ, DAMPING), strict=True)
        )

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """A mass that counts; none is negative."""
        return self.is_possible(estimates) and estimates["mass_kg"].value > LEAST_KG

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each body with enough soft tissue."""
        if not scenes:
            return []
        skeleton = scenes[0].skeleton
        return [cls(skeleton.body_names[b]) for b in skeleton.bodies_from_share(LIGHTEST_SHARE)]


def swing(
    push: Float[np.ndarray, "frames 3"], rate: float, eta: Eta
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Solution r [m] and r̈ [m/s²] of r̈ + 2ζω ṙ + ω² r = push, from rest where the first push holds it.

    Exact for a push that is linear between fine steps.

    Args:
        push: at the frames [m/s²].
        rate: of the frames [Hz].
        eta: frequency [Hz] and damping ratio.
    """
    return _driven(_finer(push, rate), rate, eta)


def decay(
    times: Float[np.ndarray, " frames"], eta: Eta, begin: Float[np.ndarray, "2"]
) -> tuple[Float[np.ndarray, " frames"], Float[np.ndarray, " frames"]]:
    """Solution r [m] and r̈ [m/s²] of r̈ + 2ζω ṙ + ω² r = 0.

    Args:
        times: from the beginning on [s].
        eta: frequency [Hz] and damping ratio.
        begin: r [m] and ṙ [m/s] there.
    """
    omega, damping = 2 * np.pi * eta[0], eta[1]
    first, second = _poles(eta)
    one = np.exp(first * times) * (begin[1] - second * begin[0])
    other = np.exp(second * times) * (begin[1] - first * begin[0])
    r = ((one - other) / (first - second)).real
    v = ((first * one - second * other) / (first - second)).real
    return r, -2 * damping * omega * v - omega**2 * r


@dataclass(frozen=True, eq=False)
class _SwingingMass:
    """What of a kilogramme at a body's centre of mass does not depend on how it hangs there."""

    place: Float[np.ndarray, "frames 3"]  # [m]
    felt: Float[np.ndarray, "frames 3"]  # p̈ − g [m/s²]
    push_fine: Float[np.ndarray, "steps 3"]  # −p̈ [m/s²] at fine steps
    moment_still: Float[np.ndarray, "frames 3"]  # p × (p̈ − g)
    place_cross: Float[np.ndarray, "frames 3 3"]  # p × e, by axis e
    cross_felt: Float[np.ndarray, "frames 3 3"]  # e × (p̈ − g), by axis e


@lru_cache(maxsize=KEPT)
def _soft_tissue(scene: Scene, body: int) -> _SwingingMass:
    """Kept: a search over frequency and damping asks again and again."""
    com = scene.skeleton.bodies[body].com_body
    place = scene.point_ground(body, com)
    felt = scene.material[:, body] @ np.append(com, 1.0)  # p̈ − g
    push = low_pass(-(felt + np.asarray(scene.skeleton.gravity)), scene.rate, DRIVEN_BELOW_HZ)
    axes = np.eye(3)
    return _SwingingMass(
        place,
        felt,
        _finer(push, scene.rate),
        cross(place, felt),
        np.stack([cross(place, np.broadcast_to(e, place.shape)) for e in axes], axis=2),
        np.stack([cross(np.broadcast_to(e, felt.shape), felt) for e in axes], axis=2),
    )


def _free(soft_tissue: _SwingingMass, scene: Scene, eta: Eta) -> Float[np.ndarray, "frames 6 6"]:
    """Wrenches of a kilogramme that swings out from a place or a speed along each axis, by closed form."""
    omega = 2 * np.pi * eta[0]
    columns = np.zeros((scene.frames, 6, 2, 3))
    axes = np.arange(3)
    times = np.arange(scene.frames) / scene.rate
    for k, begin in enumerate((np.array([1.0, 0.0]), np.array([0.0, 1.0]))):
        size = TRANSIENT_M_PER_S2 / omega ** (2 - k)
        r, r_dd = (size * part for part in decay(times, eta, begin))
        columns[:, axes, k, axes] = -r_dd[:, None]
        columns[:, 3:, k] = (
            -r_dd[:, None, None] * soft_tissue.place_cross - r[:, None, None] * soft_tissue.cross_felt
        )
    return columns.reshape(scene.frames, 6, 6)


def _poles(eta: Eta) -> tuple[complex, complex]:
    """Roots of p² + 2ζω p + ω²."""
    omega, damping = 2 * np.pi * eta[0], eta[1]
    root = omega * np.sqrt(complex(damping**2 - 1 + CRITICAL))
    return -damping * omega + root, -damping * omega - root


def _finer(push: Float[np.ndarray, "frames 3"], rate: float) -> Float[np.ndarray, "steps 3"]:
    """The push at steps of the equation of motion."""
    finer = _steps_a_frame(rate)
    return CubicSpline(np.arange(len(push)), push)(np.arange((len(push) - 1) * finer + 1) / finer)


def _steps_a_frame(rate: float) -> int:
    return max(1, int(np.ceil(FINER_HZ / rate)))


def _driven(
    fine: Float[np.ndarray, "steps 3"], rate: float, eta: Eta
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Likewise, of a push at fine steps; of two conjugate roots, one is enough."""
    omega, damping = 2 * np.pi * eta[0], eta[1]
    finer = _steps_a_frame(rate)
    first, second = _poles(eta)
    step, r0 = 1 / (rate * finer), fine[0] / omega**2
    one = _first_order(fine, first, -second * r0, step)[::finer]
    conjugate = first.imag != 0
    other = one.conj() if conjugate else _first_order(fine, second, -first * r0, step)[::finer]
    r = ((one - other) / (first - second)).real
    v = ((first * one - second * other) / (first - second)).real
    return r, fine[::finer] - 2 * damping * omega * v - omega**2 * r


def _first_order(
    push: Float[np.ndarray, "steps 3"], pole: complex, first: np.ndarray, step: float
) -> np.ndarray:
    """Z of ż = pole z + push from `first` on; push linear over each step [s]."""
    grown = np.exp(pole * step)
    late = (grown - 1 - pole * step) / (pole**2 * step)
    early = (grown - 1) / pole - late
    rest = (first - late * push[0])[None]
    return lfilter([late, early], [1.0, -grown], push.astype(complex), axis=0, zi=rest)[0]
