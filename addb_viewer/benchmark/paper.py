"""Figures of the dataset paper's benchmark (its table, and the rows below its double line), not comparable.

Werling et al. (2024), "AddBiomechanics Dataset: Capturing the Physics of Human Motion at Scale".
"""

ROWS: tuple[tuple[str, tuple[str, str, str, str]], ...] = (
    ("Analytical (paper)", ("4.47", "2.77", "6.15", "2.79")),
    ("MLP (paper)", ("1.41", "1.33", "0.03", "1.29")),
    ("GroundLinkNet on AddB (paper)", ("1.40", "1.34", "0.07", "1.17")),
    ("UnderPressure (own data)", ("–", "–", "–", "> 5.74")),
    ("GroundLinkNet (own data)", ("–", "–", "–", "> 3.06")),
    ("Trajectory optimization (own data)", ("–", "–", "–", "≈ 1")),
)
"""Name; acceleration of the centre of mass, torque, ground reaction moment, ground reaction force."""

DIFFERENCES = (
    "other persons, other recordings, other activities: the paper tested about eight subjects of its own",
    "the paper shows skeletons whose inertias were fitted to the forces; so does --skeleton fitted",
    "the paper does not say whether forces are averaged over both feet; means over feet fit its table",
    "the paper's moments cannot all be about the foot's origin: predicting none errs there by some "
    "0.7 N·m/kg in walks, against 0.03 for the free moment",
    "the paper's line for the centre of mass's acceleration lacks gravity; here it is in",
)
