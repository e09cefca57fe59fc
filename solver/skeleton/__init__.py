"""OpenSim models on Pinocchio: kinematic tree, coupling map, scaling, marker set, bones."""
