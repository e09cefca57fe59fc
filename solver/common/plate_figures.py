"""What force plates are like, and from which load on they tell something: the same wherever it is asked.

Settings take these as their defaults, each for itself: who changes one leaves the others.
"""

CONTACT_N = 20.0  # gait laboratories' usual contact threshold; below it a centre of pressure is noise
JUDGED_N = 50.0  # 5 N of noise are then 10 % of the force: its direction and its lever tell something
LOAD_N = 150.0  # a step departs at least so far from the zero level; less may be one foot at rest
UNTARED_SHARE = 0.2  # of a plate's largest force: an untared plate's offset stays below, no load does
FEWEST_JUDGED = 20  # loaded samples that a judgement needs
HALF_SIDE_M = 0.25  # plates are 0.4 to 0.6 m long and wide (Kistler 9281: 0.4 × 0.6, AMTI OR6: 0.46 × 0.51)
