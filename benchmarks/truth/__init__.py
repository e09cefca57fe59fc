"""The bench of truth: fits held against motions and torques that are known, or that experts made."""
