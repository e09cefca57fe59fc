"""Contacts whose force was measured in part: which recorded contacts, taken times more, close the balance.

The missing wrench is regressed on every recorded contact's own wrench, together with the errors that last a
whole trial. A contact is held to be wrong when that explains far more than its plate's usual error does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csr_array

from solver.contact.detection_balance import UP, WholeBody
from solver.contact.detection_settings import LEAST_LOST, MOST_LOST, PART_COST, DetectionSettings

# standard deviation of how much the markers exaggerate m·a: 0 to 0.07 walking, 0.2 running
BOUNCE_ERROR = 0.12
FARTHEST_ERROR = 2.0  # standard deviations that a trial may teach: more is no error but missing force

CHANNELS = (1, 3, 5)  # of a wrench: vertical force and the two horizontal moments
TRIAL_TERMS = 5  # scale, bounce, the centre of mass' two horizontal offsets, clock


@dataclass(frozen=True)
class Explained:
    """What the regression found.

    `missing` is the share of each contact's measured force that has to be added to it; nothing for contacts
    that are held to be whole. `trial` explains missing force that is none: b · measured + c · (required −
    weight), b for the entered mass and the plates' gains, c for markers on soft tissue and a stiff trunk,
    which exaggerate how the centre of mass bounces; where the centre of mass lies beside the model's; and
    plates that run late.
    """

    trial: Float[np.ndarray, "5"]
    covariance: Float[np.ndarray, "5 5"]
    missing: Float[np.ndarray, " contacts"]
    evidence: Float[np.ndarray, " contacts"]  # gain in log likelihood by calling the contact wrong
    moment_noise: float = 1.0  # what the balance of moments leaves unexplained, in its expected noise

    @classmethod
    def nothing(cls, contacts: int, settings: DetectionSettings) -> "Explained":
        """What is known before the regression."""
        covariance = np.diag(_trial_deviations(settings) ** 2)
        return cls(np.zeros(TRIAL_TERMS), covariance, np.zeros(contacts), np.zeros(contacts))


@dataclass(frozen=True)
class WrenchBalance:
    """Required and measured wrenches about the centre of mass, as one balance sees them."""

    body: WholeBody
    measured: Float[np.ndarray, "frames 6"]  # of all feet
    contacts: csr_array  # of each recorded contact, a row of frames × 6; zero where nothing of it is felt
    feet: tuple[int, ...]  # whose they are

    @classmethod
    def of(
        cls,
        body: WholeBody,
        measured_ground: Float[np.ndarray, "frames 6"],
        contacts_ground: Sequence[tuple[int, Float[np.ndarray, "some 6"]]],
        feet: Sequence[int],
    ) -> "WrenchBalance":
        """From wrenches as recorded [N, N·m about the ground origin].

        Args:
            body: the balance.
            measured_ground: of all feet.
            contacts_ground: of each contact: its first frame, and its wrench on the frames that it lasts.
            feet: whose the contacts are.
        """
        felt = [body.passed_stretch(start, wrench) for start, wrench in contacts_ground]
        empty = np.zeros(0)
        contacts = csr_array(
            (
                np.concatenate([empty, *(wrench.ravel() for _, wrench in felt)]),
                np.concatenate([empty, *(np.arange(6 * f.start, 6 * f.stop) for f, _ in felt)]).astype(int),
                np.cumsum([0, *(wrench.size for _, wrench in felt)]),
            ),
            shape=(len(felt), measured_ground.size),
        )
        return cls(body, body.passed(measured_ground), contacts, tuple(feet))

    def missing(self, explained: Explained) -> Float[np.ndarray, "frames 6"]:
        """Wrench that nothing explains [N, N·m]."""
        rest = self.body.required - self.measured - np.tensordot(explained.trial, self._trial_terms(), 1)
        return rest - (explained.missing @ self.contacts).reshape(rest.shape)

    def error(self, explained: Explained) -> Float[np.ndarray, " frames"]:
        """Standard deviation of its vertical force [N]."""
        vertical = self._trial_terms()[:, :, UP]
        spread = np.einsum("it,ij,jt->t", vertical, explained.covariance, vertical)
        return np.sqrt(self.body.noise**2 + spread)

    def explain(self, usable: Bool[np.ndarray, " frames"], settings: DetectionSettings) -> Explained:
        """Forward selection: the contact that explains most is freed, as long as one explains enough.

        Where no single one does, all of a foot's together may: a plate that always shows too little.

        Args:
            usable: frames on which no other force is missing.
            settings: noise and priors.
        """
        count = self.contacts.shape[0]
        if not usable.any():
            return Explained.nothing(count, settings)
        gram, pull = self._normal_equations(usable, settings)
        free, evidence = np.zeros(count, dtype=bool), np.zeros(count)
        solution, covariance = _solve(gram, pull, free, settings)
        while best := self._best(free, solution, covariance, settings):
            some, gain = best
            evidence[list(some)] = gain / len(some)
            if gain < PART_COST:
                break  # a suspect
            free[list(some)] = True
            solution, covariance = _solve(gram, pull, free, settings)
        limit = FARTHEST_ERROR * _trial_deviations(settings)
        found = Explained(
            trial=np.clip(solution[:TRIAL_TERMS], -limit, limit),
            covariance=covariance[:TRIAL_TERMS, :TRIAL_TERMS],
            missing=np.where(free, solution[TRIAL_TERMS:], 0.0),
            evidence=evidence,
        )
        return replace(found, moment_noise=self._moment_noise(found, usable))

    def _best(
        self,
        free: Bool[np.ndarray, " contacts"],
        solution: Float[np.ndarray, " terms"],
        covariance: Float[np.ndarray, "terms terms"],
        settings: DetectionSettings,
    ) -> tuple[tuple[int, ...], float] | None:
        """What to free next, and its gain in log likelihood."""
        held = np.flatnonzero(~free).tolist()
        together = [tuple(k for k in held if self.feet[k] == foot) for foot in dict.fromkeys(self.feet)]
        best: tuple[tuple[int, ...], float] | None = None
        for candidates in ([(k,) for k in held], [some for some in together if len(some) > 1]):
            for some in candidates:
                shares, gain = _freed(some, solution, covariance, settings)
                large = (np.abs(shares) > LEAST_LOST).all()
                if large and gain > (best[1] if best else 0.0):
                    best = some, gain
            if best and best[1] >= PART_COST:
                break
        return best

    def _moment_noise(self, explained: Explained, usable: Bool[np.ndarray, " frames"]) -> float:
        """Never less than expected: a trunk or arms without markers make it three times as much."""
        rest = self.missing(explained)[usable][:, CHANNELS[1:]] / self.body.moment_noise[usable, None]
        return max(1.0, float(np.sqrt(np.mean(rest**2))))

    def _trial_terms(self) -> Float[np.ndarray, "5 frames 6"]:
        """Of the errors that last: scale, bounce, centre of mass too far in x and in z, late forces."""
        support = self.body.required[:, UP]
        terms = np.zeros((TRIAL_TERMS, len(support), 6))
        terms[0] = self.measured
        terms[1, :, UP] = support - self.body.motion.weight
        terms[2, :, 5] = support
        terms[3, :, 3] = support
        terms[4] = np.gradient(self.measured, axis=0) * self.body.motion.rate
        return terms

    def _normal_equations(
        self, usable: Bool[np.ndarray, " frames"], settings: DetectionSettings
    ) -> tuple[Float[np.ndarray, "terms terms"], Float[np.ndarray, " terms"]]:
        """Of all terms, in standard deviations of the balance; neighbouring frames count as one."""
        body = self.body
        weigh = np.zeros_like(self.measured)
        for channel, noise in zip(CHANNELS, (body.noise, body.moment_noise, body.moment_noise), strict=True):
            weigh[usable, channel] = 1 / noise[usable]
        weigh *= np.sqrt(min(1.0, 2.0 * settings.place_cutoff_Hz / body.motion.rate))
        trial = (self._trial_terms() * weigh).reshape(TRIAL_TERMS, -1)
        contacts = self.contacts.copy()
        contacts.data *= weigh.ravel()[contacts.indices]
        target = ((body.required - self.measured) * weigh).ravel()
        across = contacts @ trial.T
        gram = np.block([[trial @ trial.T, across.T], [across, (contacts @ contacts.T).toarray()]])
        return gram, np.concatenate([trial @ target, contacts @ target])


def _solve(
    gram: Float[np.ndarray, "terms terms"],
    pull: Float[np.ndarray, " terms"],
    free: Bool[np.ndarray, " contacts"],
    settings: DetectionSettings,
) -> tuple[Float[np.ndarray, " terms"], Float[np.ndarray, "terms terms"]]:
    """Least squares with priors: the solution and its covariance."""
    deviations = np.concatenate(
        [_trial_deviations(settings), np.where(free, MOST_LOST, settings.plate_error)]
    )
    covariance = np.linalg.inv(gram + np.diag(deviations**-2.0))
    return covariance @ pull, covariance


def _freed(
    some: tuple[int, ...],
    solution: Float[np.ndarray, " terms"],
    covariance: Float[np.ndarray, "terms terms"],
    settings: DetectionSettings,
) -> tuple[Float[np.ndarray, " some"], float]:
    """Shares of these contacts if their priors were wide, and the gain in log likelihood.

    Another prior adds d to their diagonal of the inverse covariance Σ⁻¹. So x' = (1 + Σ d)⁻¹ x, and the log
    likelihood grows by −½ d xᵀ x' (Woodbury), without a new solution for each candidate.
    """
    rows = TRIAL_TERMS + np.array(some)
    change = MOST_LOST**-2.0 - settings.plate_error**-2.0
    before = solution[rows]
    shares = np.linalg.solve(np.eye(len(rows)) + change * covariance[np.ix_(rows, rows)], before)
    return shares, -0.5 * change * float(before @ shares)


def _trial_deviations(settings: DetectionSettings) -> Float[np.ndarray, "5"]:
    return np.array(
        [
            settings.mass_error,
            BOUNCE_ERROR,
            settings.com_error_m,
            settings.com_error_m,
            settings.clock_error_s,
        ]
    )
