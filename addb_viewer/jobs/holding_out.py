"""All layouts of held-out forces, judged after a fit is kept: each is kept when it comes."""

import os
from dataclasses import replace
from pathlib import Path

from solver.common.progress import Progress
from solver.dynamics.cross_validation.held_out import HeldOutLayout
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.fit import Fit
from solver.fitting.held_out_stage import completing_held_out, layouts_due
from solver.fitting.results.store import add_held_out
from solver.fitting.settings import Settings


class FitReplacedError(Exception):
    """Another fit has taken the place of the one whose layouts are judged."""


class HoldingOut:
    """Judges a fit, and keeps that with it; `fit` has what came so far, also after an interruption."""

    def __init__(self, fit: Fit, folder: Path, solve: str | None) -> None:
        """Nothing is computed yet.

        Args:
            fit: as it is kept.
            folder: the results folder.
            solve: the name, in it, of the folder that holds the fit; None: it is not kept.
        """
        self.fit, self._folder, self._solve = fit, folder, solve

    @property
    def is_due(self) -> bool:
        """Whether layouts are left, and can be kept with a fit that is."""
        can_be_kept = self._solve is None or os.access(self._folder / self._solve, os.W_OK | os.X_OK)
        return can_be_kept and bool(layouts_due(self.fit))

    def run(self, settings: Settings, progress: Progress, extension: Extension | None) -> None:
        """Judge what is left.

        Args:
            settings: of the fit.
            progress: told the fraction done.
            extension: of the fit.

        Raises:
            FitReplacedError: there is another fit in the results folder by now.
            ResultsError: the results folder cannot be written to.
        """
        completing_held_out(self.fit, settings, progress, extension=extension, came=self._came)

    def _came(self, layout: HeldOutLayout) -> None:
        self.fit = replace(self.fit, held_out_layouts=(*self.fit.held_out_layouts, layout))
        if self._solve is not None and not add_held_out(self.fit, self._folder, self._solve):
            raise FitReplacedError
