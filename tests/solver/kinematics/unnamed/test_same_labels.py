from dataclasses import replace

import numpy as np

from solver.kinematics.label_reading import disagreeing


def test_recordings_of_the_same_labels_agree(walker):
    markers, _ = walker
    later = replace(markers, positions_ground=markers.positions_ground[::-1])
    assert disagreeing([markers, later]) is None


def test_labels_that_were_given_anew_are_told(walker):
    markers, _ = walker
    shuffled = np.random.default_rng(1).permutation(len(markers.names))
    other = replace(markers, positions_ground=markers.positions_ground[:, shuffled])
    assert "recordings 1 and 2" in disagreeing([markers, other])
