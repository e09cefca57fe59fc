"""What the body model gets wrong of a person, learnt on frames with forces and foretold on those without."""
