"""Wobbling mass: part of a segment swings beside its bone, which the markers do not show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from solver.effects.about import About, AtFault, Named
from solver.effects.effect import Candidate, Estimate, Eta, Signature
from solver.effects.pictures import Ball
from solver.effects.readings import Reading
from solver.effects.scene import Scene
from solver.filters import low_pass
from solver.skeleton.forward import cross

LIGHTEST_SHARE = 0.04  # of body mass, of a segment with flesh that counts: a shank is
PRIOR_STD_KG = 4.0
LEAST_KG = 1.0
FREQUENCIES_HZ = (1.5, 15.0)
DAMPING = (0.02, 1.5)
DRIVEN_BELOW_HZ = 8.0  # above, accelerations are markers' noise, and a signature that shares it explains it
FINER_HZ = 400.0  # steps of the equation of motion
CRITICAL = 1e-6  # both roots are one at critical damping; kept apart by so much
TRANSIENT_M_PER_S2 = 1.5  # a push that could have set it swinging before the recording begins


ABOUT = About(
    id="wobbling_mass",
    title="flesh that swings: {target}",
    sentence="Soft tissue of {target} swings on its own, and the markers do not show it.",
    remedy="Strap it, or say how much of the segment swings, and how fast.",
    told_apart_by="a hop or a heel drop, after which it swings out",
    branch="body/flesh",
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


@dataclass(frozen=True)
class WobblingMass(Candidate):
    """A mass m at the segment's centre of mass hangs on a spring and a damper, alike in all directions.

    Its way r from there obeys r̈ + 2ζω ṙ + ω² r = −p̈. The model has it fixed: what a fixed mass demands less
    what the swinging one demands acts like an external wrench, −m r̈ at p and −r × m(p̈ + r̈ − g). η: frequency
    and damping ratio; m acts linearly. Six more columns let it swing already when the recording begins.
    """

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """What abdomen, thigh and calf do."""
        return ((3.0, 0.2), (5.0, 0.2), (8.0, 0.2))

    def steps(self) -> Eta:
        """[Hz], and of the damping ratio."""
        return (0.8, 0.08)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Of frequency [Hz] and damping ratio."""
        return ((5.0, 2.5), (0.25, 0.2))

    def admissible(self, eta: Eta) -> bool:
        """Within what flesh does."""
        frequency, damping = eta
        return FREQUENCIES_HZ[0] <= frequency <= FREQUENCIES_HZ[1] and DAMPING[0] <= damping <= DAMPING[1]

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """A kilogramme that swings from rest, and six ways to swing from the beginning."""
        if self.target not in scene.skeleton.body_names:
            return None
        body = scene.skeleton.body_index(self.target)
        com = scene.skeleton.bodies[body].com_body
        place = scene.point_ground(body, com)
        felt = scene.material[:, body] @ np.append(com, 1.0)  # p̈ − g
        push = low_pass(-(felt + np.asarray(scene.skeleton.gravity)), scene.rate, DRIVEN_BELOW_HZ)
        r, r_dd = swing(push, scene.rate, eta)
        columns = [_wrench(place, felt, r, r_dd)]
        still = np.zeros_like(push)
        prior = [PRIOR_STD_KG]
        for k in range(6):
            begin = np.zeros((2, 3))
            begin[k // 3, k % 3] = TRANSIENT_M_PER_S2 / (2 * np.pi * eta[0]) ** (2 - k // 3)
            r, r_dd = swing(still, scene.rate, eta, begin)
            columns.append(np.concatenate([-r_dd, -cross(place, r_dd) - cross(r, felt)], axis=1))
            prior.append(PRIOR_STD_KG)
        return Signature(np.stack(columns, axis=-1), np.array(prior))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "7"],
        covariance: Float[np.ndarray, "7 7"],
    ) -> dict[str, Estimate]:
        """mass_kg, frequency_Hz, damping_ratio."""
        return {
            "mass_kg": Estimate(float(x[0]), float(np.sqrt(covariance[0, 0]))),
            "frequency_Hz": Estimate(eta[0], eta_std[0]),
            "damping_ratio": Estimate(eta[1], eta_std[1]),
        }

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """Flesh that swings slower or faster, or goes on by itself, is no flesh."""
        eta = estimates["frequency_Hz"], estimates["damping_ratio"]
        return all(
            low - e.std <= e.value <= high + e.std
            for e, (low, high) in zip(eta, (FREQUENCIES_HZ, DAMPING), strict=True)
        )

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """A mass that counts; none is negative."""
        return self.is_possible(estimates) and estimates["mass_kg"].value > LEAST_KG


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each body with enough flesh."""
    if not scenes:
        return []
    skeleton = scenes[0].skeleton
    return [WobblingMass(skeleton.body_names[b]) for b in skeleton.bodies_from_share(LIGHTEST_SHARE)]


def swing(
    push: Float[np.ndarray, "frames 3"],
    rate: float,
    eta: Eta,
    begin: Float[np.ndarray, "2 3"] | None = None,
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Solution r [m] and r̈ [m/s²] of r̈ + 2ζω ṙ + ω² r = push; exact for one linear between fine steps.

    Args:
        push: at the frames [m/s²].
        rate: of the frames [Hz].
        eta: frequency [Hz] and damping ratio.
        begin: r [m] and ṙ [m/s] at the first frame; None: at rest where the first push holds it.
    """
    omega, damping = 2 * np.pi * eta[0], eta[1]
    finer = max(1, int(np.ceil(FINER_HZ / rate)))
    fine = CubicSpline(np.arange(len(push)), push)(np.arange((len(push) - 1) * finer + 1) / finer)
    root = omega * np.sqrt(complex(damping**2 - 1 + CRITICAL))
    poles = -damping * omega + np.array([root, -root])
    r0, v0 = (push[0] / omega**2, np.zeros(3)) if begin is None else begin
    one, other = (
        _first_order(fine, pole, v0 - conjugate * r0, 1 / (rate * finer))[::finer]
        for pole, conjugate in zip(poles, poles[::-1], strict=True)
    )
    r = ((one - other) / (poles[0] - poles[1])).real
    v = ((poles[0] * one - poles[1] * other) / (poles[0] - poles[1])).real
    return r, push - 2 * damping * omega * v - omega**2 * r


def _first_order(
    push: Float[np.ndarray, "steps 3"], pole: complex, first: np.ndarray, step: float
) -> np.ndarray:
    """Z of ż = pole z + push from `first` on; push linear over each step [s]."""
    grown = np.exp(pole * step)
    late = (grown - 1 - pole * step) / (pole**2 * step)
    early = (grown - 1) / pole - late
    rest = (first - late * push[0])[None]
    return lfilter([late, early], [1.0, -grown], push.astype(complex), axis=0, zi=rest)[0]


def _wrench(
    place_ground: Float[np.ndarray, "frames 3"],
    felt_ground: Float[np.ndarray, "frames 3"],
    r: Float[np.ndarray, "frames 3"],
    r_dd: Float[np.ndarray, "frames 3"],
) -> Float[np.ndarray, "frames 6"]:
    """A kilogramme fixed at the place less one that is r away: force, moment about the ground origin."""
    moment = cross(place_ground, felt_ground) - cross(place_ground + r, felt_ground + r_dd)
    return np.concatenate([-r_dd, moment], axis=1)
