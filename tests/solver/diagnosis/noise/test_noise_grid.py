"""The climb over the scales, on surfaces whose top is known."""

from dataclasses import dataclass

import numpy as np
import pytest

from solver.diagnosis.noise.noise_grid import MODEL_SCALES, NoiseGrid
from solver.diagnosis.noise.noise_scales import Basis, Covariances, NoiseScale


@dataclass(frozen=True)
class Fitted:
    noise_scale: NoiseScale
    log_evidence: float


@pytest.fixture(scope="module")
def noise_grid() -> NoiseGrid:
    one = np.eye(1)
    return NoiseGrid(Basis(Covariances(np.ones(1), (one,), (one,), 0 * one, one)))


def hill(top: NoiseScale, trade: float):
    """Log-evidence that falls with the distance from a scale, less where one stands in for the other."""

    def fitted(noise_scale: NoiseScale) -> Fitted:
        model, slack = np.log(noise_scale.scale / top.scale), np.log(noise_scale.slack / top.slack)
        return Fitted(noise_scale, float(-(model**2) - slack**2 - 2 * trade * model * slack))

    return fitted


@pytest.mark.parametrize("trade", [0.0, 0.5, -0.2])
def test_the_top_is_found_from_anywhere(noise_grid, trade):
    for top in noise_grid.noise_scales[::5]:
        for near in (None, *noise_grid.noise_scales[::7]):
            assert noise_grid.best(hill(top, trade), near).noise_scale is top


@pytest.mark.parametrize("near", [None, 0, 14])
def test_no_noise_scale_is_fitted_twice_on_the_way(noise_grid, near):
    asked = []
    surface = hill(noise_grid.noise_scales[-1], 0.3)

    def fitted(noise_scale):
        asked.append(noise_scale)
        return surface(noise_scale)

    noise_grid.best(fitted, None if near is None else noise_grid.noise_scales[near])
    assert len(asked) == len({id(r) for r in asked})


def test_nearest_is_the_noise_scale_whose_scales_differ_least(noise_grid):
    near = noise_grid.nearest(1.05 * min(MODEL_SCALES), 0.9)
    assert (near.scale, near.slack) == (min(MODEL_SCALES), 1.0)
    assert noise_grid.nearest(0.001, 0.001) is noise_grid.noise_scales[0]
