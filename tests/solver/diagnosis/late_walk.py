"""A walk whose forces were recorded 25 ms late, beside the same walk recorded with one clock."""

from dataclasses import dataclass

import numpy as np

from solver.capture.subject.opened_subject import open_subject
from solver.diagnosis.diagnose_subject import balance_of
from solver.diagnosis.scenes import scenes_of
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.refinement import refine
from solver.diagnosis.search.terms import Solved
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.simulate.subject_folder import write_subject
from tests.conftest import MARKERS_ALONE
from tests.measured_walk import WOMAN, measured_walk

LATE_S = 0.025  # on three held-out blocks a few milliseconds drown in what no fit predicts
SETTINGS = Settings()


@dataclass(frozen=True)
class Case:
    fit: Fit
    balance: Balance

    def solved(self, candidate, eta=()) -> Solved:
        noise_scale = self.balance.noise_scales[5]
        term = refine(self.balance, self.balance.term(candidate, eta), (), noise_scale)
        return self.balance.solve_at([term], noise_scale)

    @property
    def scene(self):
        return self.balance.scenes[0]


def case_of(folder, delay_s) -> Case:
    write_subject(folder, WOMAN, [measured_walk(force_delay_s=delay_s)])
    fit = solve(open_subject(folder), MARKERS_ALONE)
    return Case(fit, balance_of(fit, scenes_of(fit, SETTINGS, {}), SETTINGS.diagnosis))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))
