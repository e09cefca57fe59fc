"""One trial's rows of the wrench balance, and what they may be without a cause."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.white_noise import white_noise
from solver.diagnosis.causes.about import Weight
from solver.diagnosis.causes.effect import Candidate, Eta
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, force_at
from solver.diagnosis.noise.model_errors import (
    SCALE_STD,
    mass_change,
    model_error,
    nuisances,
    soft_tissue,
    unseen_posture,
)
from solver.dynamics.force_prediction.marker_posterior import LongMarkerPosterior, MarkerPosterior
from solver.dynamics.weighted_means import Windows, windows_over
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.skeleton.forward import cross
from solver.skeleton.rotations import skew

WINDOW_S = 0.06  # shorter than anything that markers can tell of a force
END_S = 0.05  # at both ends of a trial the spline is loose
SLOWEST_HZ = 80.0  # samples: of slower ones, steps look like noise


@dataclass(frozen=True, eq=False)
class SignatureRows:
    """A candidate's signature among the rows of one trial."""

    columns: Float[np.ndarray, "rows parameters"]
    prior_std: Float[np.ndarray, " parameters"]
    fixed: Float[np.ndarray, " rows"] | None


@dataclass(frozen=True, eq=False)
class TrialRows:
    """One trial's rows of the balance."""

    scene: Scene
    windows: Windows
    covariance: Float[np.ndarray, "rows rows"]  # of markers and plates
    model_error: Float[np.ndarray, "rows rows"]  # at scale 1
    nuisance: Float[np.ndarray, "rows nuisances"]  # shared by trials, each at one standard deviation
    tissue: Float[np.ndarray, "rows columns"]  # likewise, of soft tissue that slides
    mass: Float[np.ndarray, " rows"]  # the whole body's mass among them, at one standard deviation

    def reduce(
        self, wrench_ground: Float[np.ndarray, "frames 6 *columns"]
    ) -> Float[np.ndarray, "rows *columns"]:
        """Frame-by-frame wrenches about the ground origin as rows: window means about the centre of mass."""
        used, windows = self._used
        moved = np.asarray(wrench_ground, dtype=float)[used]
        arm = self.scene.com_ground[used]
        if moved.ndim == 3:
            arm = arm[:, None]
            moved[:, 3:] -= cross(arm, moved[:, :3].transpose(0, 2, 1)).transpose(0, 2, 1)
        else:
            moved[:, 3:] -= cross(arm, moved[:, :3])
        means = windows.means(moved)
        return means.reshape(-1, *means.shape[2:])

    @cached_property
    def _used(self) -> tuple[Int[np.ndarray, " used"], Windows]:
        """Frames of the windows, and these among them: in a long trial they lie far apart."""
        inside = np.unique(self.windows.start[:, None] + np.arange(self.windows.length))
        start = np.searchsorted(inside, self.windows.start)
        return inside, Windows(len(inside), start, self.windows.weights)

    def rows_of(self, candidate: Candidate, eta: Eta) -> "SignatureRows | None":
        """A candidate's signature as rows, piece by piece; None where it does not touch the trial."""
        parts, stds, fixed = [], [], None
        for piece in candidate.pieces(self.scene, eta):
            if len(piece.prior_std):
                parts.append(self.reduce(piece.columns))
                stds.append(piece.prior_std)
            if piece.fixed is not None:
                fixed = self.reduce(piece.fixed)
        if not parts and fixed is None:
            return None
        nothing = np.zeros((len(self.residual), 0))
        return SignatureRows(
            np.concatenate([nothing, *parts], axis=1), np.concatenate([np.zeros(0), *stds]), fixed
        )

    def touched_by(self, frames: Bool[np.ndarray, " frames"]) -> Bool[np.ndarray, " windows"]:
        """Windows in which some of these frames lie."""
        before = np.concatenate([[0], np.cumsum(frames)])
        start = self.windows.start
        return np.asarray(before[start + self.windows.length] > before[start])

    def without(self, frames: Bool[np.ndarray, " frames"]) -> "TrialRows":
        """The same where these frames do not count."""
        kept = ~self.touched_by(frames)
        own = np.repeat(kept, 6)
        return TrialRows(
            replace(self.scene, counts=self.scene.counts & ~frames),
            replace(self.windows, start=self.windows.start[kept]),
            self.covariance[np.ix_(own, own)],
            self.model_error[np.ix_(own, own)],
            self.nuisance[own],
            self.tissue[own],
            self.mass[own],
        )

    @cached_property
    def residual(self) -> Float[np.ndarray, " rows"]:
        """Required less measured."""
        return self.reduce(self.scene.required_ground - self.scene.measured_ground)


class ScaleRows(TrialRows):
    """A scale's reading of who stands still: the vertical force of one window, which masses alone change."""

    def reduce(
        self, wrench_ground: Float[np.ndarray, "frames 6 *columns"]
    ) -> Float[np.ndarray, "rows *columns"]:
        """The vertical force."""
        rows = np.zeros(wrench_ground.shape[1:])
        rows[1] = wrench_ground[0, 1]
        return rows

    def rows_of(self, candidate: Candidate, eta: Eta) -> "SignatureRows | None":
        """Of a mass; None of any other cause."""
        return super().rows_of(candidate, eta) if candidate.about.weight is Weight.MASS else None

    @cached_property
    def residual(self) -> Float[np.ndarray, " rows"]:
        """Weight as entered less what the scale reads; zero before it is read."""
        return (1.0 - (self.scene.scale_factor or 1.0)) * self.reduce(self.scene.required_ground)


def scale_rows(own: TrialRows, settings: DiagnosisSettings) -> ScaleRows:
    """Of the person in a trial, in the posture of its first frame."""
    scene, gravity = own.scene, np.asarray(own.scene.skeleton.gravity)
    material = np.zeros_like(scene.material[:1]) - gravity[:, None] * [0.0, 0.0, 0.0, 1.0]
    still = replace(
        scene,
        name="",
        R_ground_body=scene.R_ground_body[:1],
        p_ground_body=scene.p_ground_body[:1],
        com_ground=scene.com_ground[:1],
        material=material,
        required_ground=force_at(-scene.skeleton.mass * gravity, scene.com_ground[:1]),
    )
    error, tissue = (SCALE_STD * scene.weight_N) ** 2 * np.eye(6), np.zeros((6, own.tissue.shape[1]))
    rows = ScaleRows(still, own.windows, error, 0.0 * error, np.zeros((6, 0)), tissue, np.zeros(6))
    inertias, mass = nuisances(still, rows.reduce, settings), mass_change(still, rows.reduce, settings)
    return replace(rows, nuisance=inertias, mass=mass)


def trial_rows(
    scene: Scene, posterior: MarkerPosterior | LongMarkerPosterior, settings: DiagnosisSettings, hop_s: float
) -> TrialRows | None:
    """One trial's rows and their covariance; None where no window has frames that all count.

    Args:
        scene: made from the posterior's motion.
        posterior: of the markers.
        settings: noise and model error.
        hop_s: from window to window [s].
    """
    counts = scene.counts.copy()
    ends = round(END_S * scene.rate)
    counts[:ends] = counts[len(counts) - ends :] = False
    windows = windows_over(counts, scene.rate, WINDOW_S, hop_s)
    if not windows.count:
        return None
    markers = posterior.wrench_covariance(scene.measured_ground, windows)
    of_window = np.arange(windows.count)
    blocks = markers.reshape(windows.count, 6, windows.count, 6)
    blocks[of_window, :, of_window] += readings_noise(scene, windows, settings)
    markers += unseen_posture(scene, windows)
    nothing = np.zeros((0, 0))
    rows = TrialRows(scene, windows, markers, nothing, nothing, nothing, np.zeros(0))
    return TrialRows(
        scene,
        windows,
        markers,
        model_error(scene, windows),
        nuisances(scene, rows.reduce, settings),
        soft_tissue(scene, rows.reduce, settings),
        mass_change(scene, rows.reduce, settings),
    )


def plate_noise(plate: PlateScene) -> Float[np.ndarray, "6"]:
    """Standard deviation of a sample's force [N] and moment about the plate's centre [N·m], while loaded.

    White noise, as large as its samples tell; low-passed recordings have none. Where raw ones are sampled no
    faster than the markers, a window averages few of them, and what is left can be more than any filtered
    plate's noise.
    """
    recorded = plate.plate
    if recorded.rate < SLOWEST_HZ:
        return np.zeros(6)
    moment = recorded.moment_ground - cross(plate.centre_ground, recorded.force_ground)
    wrench = np.concatenate([recorded.force_ground, moment], axis=1)
    return np.nan_to_num(white_noise(np.where(plate.loads.carrying[:, None], wrench, np.nan)))


def readings_noise(
    scene: Scene, windows: Windows, settings: DiagnosisSettings
) -> Float[np.ndarray, "windows 6 6"]:
    """Of filtered plates, and of the white noise of raw ones; arguments as in `plates_noise`."""
    noise = np.repeat([settings.force_noise_N, settings.moment_noise_Nm], 3)
    return np.diag(noise**2) + plates_noise(scene, windows)


def plates_noise(scene: Scene, windows: Windows) -> Float[np.ndarray, "windows 6 6"]:
    """Covariance of each window's measured force [N] and moment about the centre of mass [N·m].

    Args:
        scene: with its plates at the markers' frames.
        windows: of the balance; what two of them share is left out.
    """
    total = np.zeros((windows.count, 6, 6))
    per_second = scene.rate * float(
        (windows.weights**2).sum()
    )  # of a window: of noise of one sample a second
    com = windows.means(scene.com_ground)
    for plate in scene.plates:
        variance = plate_noise(plate) ** 2 * per_second / plate.plate.rate
        if not variance.any():
            continue
        about_com = np.tile(np.eye(6), (windows.count, 1, 1))
        about_com[:, 3:, :3] = skew(plate.centre_ground - com)
        loaded = windows.means(plate.loaded.astype(float))
        total += loaded[:, None, None] * (about_com * variance) @ about_com.transpose(0, 2, 1)
    return total
