"""What speaks against a cause: too small to act on, impossible, another body mass, the others undone."""

from collections.abc import Sequence

import numpy as np

from solver.diagnosis.balance import Balance, Solved
from solver.diagnosis.contenders import Contender, cosine

MORE_STRAIN = 1.0  # [prior deviations of the mass] a cause may ask for beyond what is wrong with it already


class Admission:
    """Tests of the last cause of a set, or of a given one, that look at no withheld block."""

    def __init__(self, balance: Balance) -> None:
        self.balance, self.settings = balance, balance.settings

    def admissible(self, after: Solved, before: Solved) -> bool:
        """Whether the last cause is notable and does not lean on a body of another mass."""
        return self.notable(after) and not self._leans_on_the_mass(after, before)

    def leads(self, one: Contender, tenable: Sequence[Contender]) -> bool:
        """Whether nothing else comes near: then it stays, even if the mass is wrong as well."""
        others = [c.odds_gain(self.settings) for c in tenable if c is not one]
        return one.odds_gain(self.settings) - max(others, default=0.0) > self.settings.sure_lead

    def undoes_the_others(self, after: Solved) -> bool:
        """Whether the last cause mostly takes back what the others explain: only their difference is seen."""
        *others, last = (after.explained(k, after.rung) for k in range(len(after.terms)))
        return bool(others) and -cosine(last, np.sum(others, axis=0)) > self.settings.undone

    def tenable(self, after: Solved, before: Solved) -> bool:
        """Whether the last cause, large or small, may be what is wrong."""
        last = after.terms[-1].candidate
        possible = last.is_possible(after.estimates(len(after.terms) - 1, self.balance.scenes))
        return possible and not self._leans_on_the_mass(after, before)

    def _leans_on_the_mass(self, after: Solved, before: Solved) -> bool:
        """Whether the last cause needs a body of another mass than the entered one.

        Without it, the mass is judged at the same scale: a cause that sharpens the balance shows what was
        wrong with the mass already.
        """
        strain = abs(self.balance.mass_strain(after))
        same_scale = self.balance.solve_at(before.terms, after.rung)
        already = abs(self.balance.mass_strain(same_scale)) + MORE_STRAIN
        return strain > max(self.settings.most_mass_strain, already)

    def notable(self, solved: Solved, k: int = -1) -> bool:
        """Whether the k-th term's size is one that anybody would act on."""
        k %= len(solved.terms)
        return solved.terms[k].candidate.is_notable(solved.estimates(k, self.balance.scenes))
