"""The climb over the scales, on surfaces whose top is known."""

from dataclasses import dataclass

import numpy as np
import pytest

from solver.diagnosis.noise.covariances import Covariances
from solver.diagnosis.noise.ladder import Ladder
from solver.diagnosis.noise.rungs import Basis, Rung
from solver.fitting.diagnosis_settings import DiagnosisSettings

SETTINGS = DiagnosisSettings()


@dataclass(frozen=True)
class Fitted:
    rung: Rung
    log_evidence: float


@pytest.fixture(scope="module")
def ladder() -> Ladder:
    one = np.eye(1)
    return Ladder(Basis(Covariances(np.ones(1), (one,), (one,), 0 * one, one)), SETTINGS)


def hill(top: Rung, trade: float):
    """Log-evidence that falls with the distance from a rung, less where one scale stands in for the other."""

    def fitted(rung: Rung) -> Fitted:
        model, slack = np.log(rung.scale / top.scale), np.log(rung.slack / top.slack)
        return Fitted(rung, float(-(model**2) - slack**2 - 2 * trade * model * slack))

    return fitted


@pytest.mark.parametrize("trade", [0.0, 0.5, -0.2])
def test_the_top_is_found_from_anywhere(ladder, trade):
    for top in ladder.rungs[::5]:
        for near in (None, *ladder.rungs[::7]):
            assert ladder.best(hill(top, trade), near).rung is top


@pytest.mark.parametrize("near", [None, 0, 14])
def test_no_rung_is_fitted_twice_on_the_way(ladder, near):
    asked = []
    surface = hill(ladder.rungs[-1], 0.3)

    def fitted(rung):
        asked.append(rung)
        return surface(rung)

    ladder.best(fitted, None if near is None else ladder.rungs[near])
    assert len(asked) == len({id(r) for r in asked})


def test_nearest_is_the_rung_whose_scales_differ_least(ladder):
    near = ladder.nearest(1.05 * min(SETTINGS.model_scales), 0.9)
    assert (near.scale, near.slack) == (min(SETTINGS.model_scales), 1.0)
    assert ladder.nearest(0.001, 0.001) is ladder.rungs[0]
