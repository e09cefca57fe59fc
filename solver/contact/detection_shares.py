"""Contacts whose force was measured in part: which recorded contacts, taken times more, close the balance.

The missing wrench is regressed on every recorded contact's own wrench, together with the errors that last a
whole trial. A contact is held to be measured in part when that explains far more than its plate's usual error.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.contact.detection_balance import UP, WholeBody
from solver.contact.detection_settings import DetectionSettings

CHANNELS = (1, 3, 5)  # of a wrench: vertical force and the two horizontal moments
TRIAL_TERMS = 4  # scale, bounce, and the centre of mass' two horizontal offsets


@dataclass(frozen=True)
class RecordedContact:
    """One foot on one plate, frames `start` up to, not including, `end`."""

    foot: int
    start: int
    end: int


@dataclass(frozen=True)
class Explained:
    """What the regression found.

    `missing` is the share of each contact's measured force that has to be added to it; nothing for contacts
    that are held to be whole. `trial` explains missing support that is none: b · measured + c · (demanded −
    weight), b for the entered mass and plates' gains, c for markers on soft tissue and a stiff trunk, which
    exaggerate how the centre of mass bounces.
    """

    trial: Float[np.ndarray, "4"]
    covariance: Float[np.ndarray, "4 4"]
    missing: Float[np.ndarray, " contacts"]
    evidence: Float[np.ndarray, " contacts"]  # log odds that the contact is measured in part

    @classmethod
    def nothing(cls, contacts: int, settings: DetectionSettings) -> "Explained":
        """What is known before the regression."""
        covariance = np.diag(_trial_deviations(settings) ** 2)
        return cls(np.zeros(TRIAL_TERMS), covariance, np.zeros(contacts), np.zeros(contacts))

    def of_trial(
        self, body: WholeBody, measured: Float[np.ndarray, "frames 6"]
    ) -> tuple[Float[np.ndarray, "frames 6"], Float[np.ndarray, " frames"]]:
        """Wrench that the trial's errors explain, and the standard deviation of its vertical force [N]."""
        terms = _trial_terms(body, measured)
        wrench = np.einsum("ktc,k->tc", terms, self.trial)
        vertical = terms[:, :, UP].T
        return wrench, np.sqrt(np.einsum("ti,ij,tj->t", vertical, self.covariance, vertical))


def explain(
    body: WholeBody,
    measured: Float[np.ndarray, "frames 6"],
    wrenches: Sequence[Float[np.ndarray, "frames 6"]],
    usable: Bool[np.ndarray, " frames"],
    settings: DetectionSettings,
) -> Explained:
    """Forward selection: the contact that explains most is freed, as long as one explains enough.

    Args:
        body: slow balance.
        measured: all feet's wrench as it passes the balance.
        wrenches: every recorded contact's own, likewise.
        usable: frames on which no other force is missing.
        settings: noise and priors.
    """
    if not usable.any():
        return Explained.nothing(len(wrenches), settings)
    noise = np.column_stack([body.noise, body.moment_noise, body.moment_noise])
    share = min(1.0, 2.0 * settings.place_cutoff_Hz / body.motion.rate)  # of an independent frame
    weigh = np.sqrt(share) / noise[usable]
    columns = np.stack([*_trial_terms(body, measured), *wrenches])[:, usable][:, :, CHANNELS] * weigh
    target = ((body.demanded - measured)[usable][:, CHANNELS] * weigh).ravel()
    matrix = columns.reshape(len(columns), -1)
    gram, pull = matrix @ matrix.T, matrix @ target
    contacts = len(wrenches)
    free = np.zeros(contacts, dtype=bool)
    evidence = np.zeros(contacts)
    energy, solution, covariance = _solve(gram, pull, free, settings)
    while True:
        tried = {k: _solve(gram, pull, free | (np.arange(contacts) == k), settings) for k in np.flatnonzero(~free)}
        gains = {
            k: energy - found[0]
            for k, found in tried.items()
            if found[1][TRIAL_TERMS + k] > settings.least_lost
        }
        best = max(gains, key=lambda k: gains[k], default=None)
        if best is None or gains[best] < settings.part_cost:
            break
        free[best], evidence[best] = True, gains[best] - settings.part_cost
        energy, solution, covariance = tried[best]
    limit = settings.farthest_error * _trial_deviations(settings)
    return Explained(
        trial=np.clip(solution[:TRIAL_TERMS], -limit, limit),
        covariance=covariance[:TRIAL_TERMS, :TRIAL_TERMS],
        missing=np.where(free, solution[TRIAL_TERMS:], 0.0),
        evidence=evidence,
    )


def _solve(
    gram: Float[np.ndarray, "terms terms"],
    pull: Float[np.ndarray, " terms"],
    free: Bool[np.ndarray, " contacts"],
    settings: DetectionSettings,
) -> tuple[float, Float[np.ndarray, " terms"], Float[np.ndarray, "terms terms"]]:
    """Least squares with priors: half the sum of squares (but for a constant), solution and covariance."""
    deviations = np.concatenate(
        [_trial_deviations(settings), np.where(free, settings.most_lost, settings.plate_error)]
    )
    covariance = np.linalg.inv(gram + np.diag(deviations**-2.0))
    solution = covariance @ pull
    return -0.5 * float(pull @ solution), solution, covariance


def _trial_deviations(settings: DetectionSettings) -> Float[np.ndarray, "4"]:
    return np.array([settings.mass_error, settings.bounce_error, settings.com_error_m, settings.com_error_m])


def _trial_terms(
    body: WholeBody, measured: Float[np.ndarray, "frames 6"]
) -> Float[np.ndarray, "4 frames 6"]:
    """Wrenches of the errors that last: scale, bounce, centre of mass too far in x and in z."""
    support = body.demanded[:, UP]
    terms = np.zeros((TRIAL_TERMS, len(support), 6))
    terms[0] = measured
    terms[1, :, UP] = support - body.motion.weight
    terms[2, :, 5] = support
    terms[3, :, 3] = support
    return terms
