"""Residual reduction by the torso's mass and centre, the idea of OpenSim's RRA: it names nothing."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from benchmarks.hidden.rows.balance import GRAVITY, MarkerBalance
from solver.skeleton.forward import cross

TORSO = "torso"


def with_torso_shifted(balances: Sequence[MarkerBalance]) -> list[Float[np.ndarray, "frames 6"]]:
    """The wrenches required once the torso's mass, and its centre along its own x and z, are shifted.

    The three numbers make the mean vertical force and the mean moments about the two horizontal axes vanish.
    """
    columns = [_columns(b) for b in balances]
    known = np.concatenate([b.known for b in balances])
    mean = np.concatenate([b.residual for b in balances])[known].mean(axis=0)
    slopes = np.concatenate(columns)[known].mean(axis=0)
    balanced = [1, 3, 5]  # vertical force, moments about x and z
    x = np.linalg.lstsq(slopes[balanced], -mean[balanced], rcond=None)[0]
    return [b.required + c @ x for b, c in zip(balances, columns, strict=True)]


def _columns(b: MarkerBalance) -> Float[np.ndarray, "frames 6 3"]:
    """By a kilogram more at the torso's centre, and by a metre of its centre along its x and z."""
    k = b.body(TORSO)
    push = b.acceleration(k) - GRAVITY
    heavier = b.at(push, b.body_com[:, k])
    axes = (b.body_R[:, k, :, 0], b.body_R[:, k, :, 2])
    moved = [np.concatenate([0 * push, b.body_masses[k] * cross(axis, push)], axis=1) for axis in axes]
    return np.stack([heavier, *moved], axis=2)
