"""Scaling, marker offsets and inverse kinematics."""
