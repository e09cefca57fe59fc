"""Who is in a synthetic corpus: sex, age, stature and mass as people have them."""

from dataclasses import dataclass

import numpy as np

from solver.skeleton.segment_tables import Sex

YOUNGEST, OLDEST, GROWN = 6.0, 84.0, 18.0  # [years]; the first two are those of the dataset paper
GROWN_SHARE = 0.85
AGES = (6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0)
MEDIAN_M: dict[Sex, tuple[float, ...]] = {
    "female": (1.15, 1.28, 1.38, 1.51, 1.60, 1.62, 1.63),
    "male": (1.15, 1.28, 1.39, 1.49, 1.64, 1.73, 1.76),
}
"""Stature at those ages, to a centimetre or two: CDC growth charts, 2000."""
STATURE_SPREAD = 0.04  # relative standard deviation within sex and age
BMI_AGES = (6.0, 12.0, 18.0, 40.0, 84.0)
MEDIAN_BMI = (15.4, 18.0, 21.5, 25.5, 26.0)  # [kg/m²] at those
BMI_SPREAD = 0.12


@dataclass(frozen=True)
class MadeUpPerson:
    """What is true of somebody."""

    sex: Sex
    age_years: float
    height_m: float
    mass_kg: float


def drawn_person(rng: np.random.Generator) -> MadeUpPerson:
    """Somebody, of any age in the paper's range; most are grown up."""
    sex: Sex = "female" if rng.random() < 0.5 else "male"
    grown = rng.random() < GROWN_SHARE
    age = float(rng.uniform(GROWN, OLDEST) if grown else rng.uniform(YOUNGEST, GROWN))
    height = float(np.interp(age, AGES, MEDIAN_M[sex]) * np.exp(STATURE_SPREAD * rng.standard_normal()))
    bmi = float(np.interp(age, BMI_AGES, MEDIAN_BMI) * np.exp(BMI_SPREAD * rng.standard_normal()))
    return MadeUpPerson(sex, round(age), round(height, 3), round(bmi * height**2, 1))
