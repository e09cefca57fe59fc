"""How well signs and zero levels of force plates agree with a person's weight and vertical acceleration.

The sum of the loads is modelled sample by sample as a mixture: all contacts are on plates, and it is
m g + c a (c the part of the body's mass that moves as the trunk does); some are, and it is anything between
nothing and that; none are, and it is nothing. Mass, c and the shares of the three are fitted to each
hypothesis; what is not determined widens its evidence by Laplace's approximation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from solver.capture.plates.plate_sign_settings import PlateSignSettings
from solver.common.gravity import GRAVITY


@dataclass(frozen=True)
class Explanation:
    """Signs of all plates, with the zero levels that suit them best."""

    signs: tuple[int, ...]
    zeros: tuple[float, ...]  # [N]
    evidence: float  # [nats]
    zero_stds: tuple[float, ...]  # [N]


class Hypotheses:
    """Weighs signs and zero levels of the plates of one recording."""

    def __init__(
        self,
        vertical_N: Float[np.ndarray, "samples plates"],
        acceleration: Float[np.ndarray, " samples"],
        agitation: Float[np.ndarray, " samples"],
        *,
        held_N: Sequence[float | None],
        mass_kg: float | None,
        settings: PlateSignSettings,
    ) -> None:
        self.settings = settings
        self.readings = vertical_N
        known = np.isfinite(acceleration) & np.isfinite(agitation)
        moves = np.where(known, acceleration, 0.0)
        self.design = np.stack([np.full_like(moves, GRAVITY), moves], axis=1)  # [N/kg]
        self.demand_std = np.where(
            known,
            np.hypot(settings.acceleration_floor, settings.acceleration_share * np.nan_to_num(agitation)),
            settings.acceleration_unknown,
        )
        shifts = np.linalg.norm(vertical_N - np.median(vertical_N, axis=0), axis=1)
        noise_N = np.hypot(settings.noise_N, settings.gain_error * shifts)
        self.mass_kg = mass_kg or settings.usual_mass_kg
        spread = settings.entered_mass_spread if mass_kg else settings.usual_mass_spread
        self.mass_std = spread * self.mass_kg
        self.sum_std = np.hypot(noise_N, self.mass_kg * self.demand_std)
        self.held = np.array([held is not None for held in held_N])
        self.expected = np.array([held or 0.0 for held in held_N])

    def best(self, signs: tuple[int, ...], tared: int | None = None) -> Explanation:
        """The best zero levels for these signs, found plate by plate; plate `tared` has none."""
        zeros = self.expected.copy()
        if tared is not None:
            zeros[tared] = 0.0
        evidence, stds = (found[0] for found in self._weighed(signs, zeros[None]))
        for _ in range(2):
            before = evidence
            pulls = np.minimum(np.asarray(signs) * (self.readings - zeros), 0.0).sum(axis=0)
            for k in np.argsort(pulls, kind="stable"):
                if k == tared:
                    continue
                candidates = self._zeros_of(k, signs, zeros)
                tried = np.repeat(zeros[None], len(candidates), axis=0)
                tried[:, k] = candidates
                values, all_stds = self._weighed(signs, tried)
                leader = int(np.argmax(values))
                if values[leader] > evidence:
                    evidence, zeros, stds = values[leader], tried[leader], all_stds[leader]
            if evidence == before:
                break
        return Explanation(signs, tuple(zeros.tolist()), float(evidence), tuple(stds.tolist()))

    def _zeros_of(
        self, k: int, signs: tuple[int, ...], zeros: Float[np.ndarray, " plates"]
    ) -> Float[np.ndarray, " candidates"]:
        """Levels worth trying: none, where the reading rests, its end, what weight and the others leave."""
        if self.held[k]:
            return self.expected[[k]]
        reading, sign = self.readings[:, k], signs[k]
        loads = np.asarray(signs) * (self.readings - zeros)
        others = loads.sum(axis=1) - loads[:, k]
        weights = 1 / self.demand_std[:, None]
        slope = np.linalg.lstsq(
            np.column_stack([self.design[:, 1], np.ones(len(reading))]) * weights,
            (sign * reading + others) * weights[:, 0],
            rcond=None,
        )[0][0]
        low, high = 0.5 * self.mass_kg, 2 * self.mass_kg
        masses = np.array([self.mass_kg, np.clip(slope / self.settings.trunk_share, low, high)])
        left = reading[:, None] - sign * (GRAVITY * masses - others[:, None])
        end = np.percentile(reading, 0.5 if sign > 0 else 99.5)
        return np.array([0.0, self.expected[k], _commonest(reading), end, *np.median(left, axis=0)])

    def _weighed(
        self, signs: tuple[int, ...], zeros: Float[np.ndarray, "tried plates"]
    ) -> tuple[Float[np.ndarray, " tried"], Float[np.ndarray, "tried plates"]]:
        """Evidence [nats] of zero levels, and how well each is known [N]."""
        settings, plates = self.settings, len(signs)
        loads = np.asarray(signs) * (self.readings - zeros[:, None])
        pull = np.minimum(loads, 0.0) / settings.tare_N
        pulled = np.log((1 - settings.outlier) * np.exp(-0.5 * pull**2) + settings.outlier).sum(axis=(1, 2))
        fit = self._fitted(loads.sum(axis=2))
        odd = zeros != self.expected
        precision = np.zeros((len(zeros), 2 + plates))
        precision[:, 0] = 1 / self.mass_std**2
        precision[:, 1] = 1 / (settings.trunk_spread * fit.mass_kg) ** 2
        precision[:, 2:] = np.where(odd, 12 / settings.untared_range_N**2, 1 / settings.tare_N**2)
        jacobian = np.concatenate(
            [self.design, np.broadcast_to(np.asarray(signs, dtype=float), self.readings.shape)], axis=1
        )
        information = np.einsum("ts,si,sj->tij", fit.whole, jacobian, jacobian)
        jacobian[:, :2] = 0.0
        information += np.einsum("ts,si,sj->tij", fit.empty, jacobian, jacobian)
        diagonal = np.arange(2 + plates)
        information[:, diagonal, diagonal] += precision
        width = 0.5 * (np.log(precision).sum(axis=1) - np.linalg.slogdet(information)[1])
        stds = np.sqrt(np.linalg.inv(information)[:, diagonal[2:], diagonal[2:]])
        beforehand = self._log_prior(signs) + np.where(
            odd.any(axis=1), np.log(settings.untared / (2**plates - 1)), np.log1p(-settings.untared)
        )
        return fit.log_likelihood + pulled + width + beforehand, stds

    def _log_prior(self, signs: tuple[int, ...]) -> float:
        settings, turned = self.settings, sum(sign < 0 for sign in signs)
        if turned == 0:
            return float(np.log1p(-settings.all_turned - settings.some_turned))
        if turned == len(signs):
            return float(np.log(settings.all_turned))
        return float(np.log(settings.some_turned / (2 ** len(signs) - 2)))

    def _fitted(self, total: Float[np.ndarray, "tried samples"]) -> "_Fit":
        """Body mass, the trunk's share and the shares of contact that make each sum likeliest."""
        settings = self.settings
        low, high = 0.2 * self.mass_kg, 4 * self.mass_kg
        standing = np.clip(total / GRAVITY, low, high)
        mass = np.percentile(standing, [20, 40, 60, 80], axis=1).T
        mass = np.concatenate([mass, np.full((len(total), 1), self.mass_kg)], axis=1)
        moving = settings.trunk_share * mass  # [kg] per acceleration of the trunk
        shares = np.full((*mass.shape, 3), (1 - settings.outlier) / 3)
        for last in (False, False, False, True):
            demand = np.maximum(np.stack([mass, moving], axis=-1) @ self.design.T, 0.0)
            densities = self._densities(total[:, None], demand)
            weighed = densities * shares[..., None, :]
            likelihood = weighed.sum(axis=-1) + settings.outlier / settings.untared_range_N
            belongs = weighed / likelihood[..., None]
            whole = belongs[..., 0] / self.sum_std**2
            if last:
                break
            to_mass = 1 / self.mass_std**2
            to_share = 1 / (settings.trunk_spread * mass) ** 2
            g, a = self.design.T
            gg, ga, aa = whole @ (g * g) + to_mass, whole @ (g * a), whole @ (a * a) + to_share
            right_g = (whole * total[:, None]) @ g + to_mass * self.mass_kg
            right_a = (whole * total[:, None]) @ a + to_share * settings.trunk_share * mass
            determinant = gg * aa - ga**2
            mass, moving = (
                np.clip((aa * right_g - ga * right_a) / determinant, low, high),
                (gg * right_a - ga * right_g) / determinant,
            )
            moving = np.clip(moving, settings.trunk_least * mass, settings.trunk_most * mass)
            counts = belongs.sum(axis=-2) + 1.0
            shares = (1 - settings.outlier) * counts / counts.sum(axis=-1, keepdims=True)
        off_share = (moving / mass - settings.trunk_share) / settings.trunk_spread
        value = np.log(likelihood).sum(axis=-1)
        value -= 0.5 * ((mass - self.mass_kg) / self.mass_std) ** 2 + 0.5 * off_share**2
        start = np.argmax(value, axis=1)
        rows = np.arange(len(total))
        empty_N = self._empty_N()
        return _Fit(
            value[rows, start], mass[rows, start], whole[rows, start], belongs[rows, start, :, 2] / empty_N**2
        )

    def _densities(
        self,
        sum_N: Float[np.ndarray, "tried #starts samples"],
        demand: Float[np.ndarray, "tried starts samples"],
    ) -> Float[np.ndarray, "tried starts samples 3"]:
        """Of the sum, where all contacts are on plates, some or none [1/N]."""
        blurred = np.hypot(self.sum_std, self.settings.tare_N)
        within = np.maximum(demand, 4 * blurred)
        partly = (ndtr(sum_N / blurred) - ndtr((sum_N - within) / blurred)) / within
        empty = np.broadcast_to(_normal(sum_N, self._empty_N()), partly.shape)
        return np.stack([_normal(sum_N - demand, self.sum_std), partly, empty], axis=-1)

    def _empty_N(self) -> float:
        return float(self.settings.tare_N * np.sqrt(self.readings.shape[1]))


@dataclass(frozen=True)
class _Fit:
    """How well each tried sum is what a body demands; weights of what tells it [1/N²]."""

    log_likelihood: Float[np.ndarray, " tried"]
    mass_kg: Float[np.ndarray, " tried"]
    whole: Float[np.ndarray, "tried samples"]
    empty: Float[np.ndarray, "tried samples"]


def _normal(
    deviation: Float[np.ndarray, "*any"], std: float | Float[np.ndarray, "*any"]
) -> Float[np.ndarray, "*any"]:
    return np.exp(-0.5 * (deviation / std) ** 2) / (np.sqrt(2 * np.pi) * std)


def _commonest(values: Float[np.ndarray, " values"]) -> float:
    """Where readings lie densest: middle of the shortest interval that holds a fifth of them."""
    ordered = np.sort(values)
    inside = max(2, len(ordered) // 5)
    if len(ordered) <= inside:
        return float(np.median(ordered))
    start = int(np.argmin(ordered[inside:] - ordered[:-inside]))
    return float(np.median(ordered[start : start + inside + 1]))
