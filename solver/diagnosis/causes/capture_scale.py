"""Capture scale: the cameras' calibration makes the room, and the person in it, too large or too small."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.diagnosis.causes.about import About, Entry, Reading
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, Signature
from solver.diagnosis.causes.observed_trial import Scene
from solver.skeleton.forward import cross

PRIOR_STD = 0.01  # a calibration wand whose markers sit 1 to 5 mm off over half a metre
OWN_MODEL_STD = 0.002  # of a body's size against its own model, fitted to markers on skin


@dataclass(frozen=True)
class CaptureScale(Candidate):
    """recorded marker = scale × true about the laboratory's origin; the skeleton is fitted to that and grows.

    True lengths and accelerations are the recorded ones over scale; masses and gravity stay. With
    x = 1 − 1/scale, and the recorded demand split into what motion asks, f with moment l about the ground
    origin, and what gravity asks, −m g with moment −c × m g,

        recorded − true = x f                     (force)
                        = (2x − x²) l − x c × m g (moment).

    The column is the part that is linear in x; at 1 % half a per cent of it is left over. Centres of pressure
    are not scaled and drift against the soles as the person goes away from the origin: the moment's column
    holds that. Where the model was made for this person, its lengths tell the scale: x starts from there. The
    entered height against the scaled skeleton is no evidence: heights are entered to a centimetre at best,
    with or without shoes, and segments' proportions differ by more than 1 %.
    """

    log_size: float | None = None  # of the fitted body over its own model; None where the model is nobody's

    about = About(
        id="capture_scale",
        entry=Entry("`all`", "recorded marker = scale × true", "`scale`"),
        title="wrong scale of the camera calibration",
        sentence="All distances between markers are too large or too small by a constant factor.",
        remedy="Calibrate the cameras with a wand whose length was measured.",
        separate_by=(
            "two markers at a known distance, or steps on plates far from the laboratory's origin, on "
            "both sides"
        ),
        branch="markers/scale of the cameras",
        doubts_angles=True,
        odds_against=12.0,
        asked_up_to=10.0,
        readings=(
            Reading(
                "scale",
                "markers lie {amount} too far {which}",
                "%",
                1e2,
                zero=1.0,
                which=("apart", "together"),
            ),
        ),
    )

    no_effect = 1.0
    least = 0.003  # a wand made with care: 1.5 mm over half a metre
    most = 0.06  # a wand read in the wrong unit is seen in the body's size long before

    @property
    def seen_elsewhere(self) -> float:
        """That the body has another size than its own model, against that it has not."""
        if self.log_size is None:
            return 0.0
        wide = np.hypot(OWN_MODEL_STD, PRIOR_STD)
        chance = 0.5 * self.log_size**2 * (OWN_MODEL_STD**-2 - wide**-2)
        return float(chance - np.log(wide / OWN_MODEL_STD))

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """What the recorded motion demands too much."""
        weight = scene.skeleton.mass * np.asarray(scene.skeleton.gravity)
        by_gravity = np.broadcast_to(-weight, scene.com_ground.shape)
        moment_by_gravity = cross(scene.com_ground, by_gravity)
        by_motion = scene.required_ground[:, :3] - by_gravity
        moment_by_motion = scene.required_ground[:, 3:] - moment_by_gravity
        column = np.concatenate([by_motion, 2 * moment_by_motion + moment_by_gravity], axis=1)
        if self.log_size is None:
            return Signature(column[:, :, None], np.array([PRIOR_STD]))
        return Signature(column[:, :, None], np.array([OWN_MODEL_STD]), column * self._start)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """scale, dimensionless; above 1 when the recording is too large."""
        scale = 1 / (1 - self._start - float(fit.x[0]))
        return {"scale": Estimate(scale, float(np.sqrt(fit.covariance[0, 0])) * scale**2)}

    @property
    def _start(self) -> float:
        return 0.0 if self.log_size is None else 1 - float(np.exp(-self.log_size))

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One room."""
        return [cls("all", scenes[0].size_against_own_model)] if scenes else []
