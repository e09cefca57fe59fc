"""The coupling map p = Φ(q), and each joint as a chain of fixed transforms and 1-dof joints p.

An OpenSim joint moves along up to six axes, each displaced by a function of one coordinate; a coordinate is
free, locked, or coupled to a free one. Every axis that moves becomes one 1-dof joint with its own position
p_k, and p_k is a function of exactly one free coordinate. So Φ' has one entry a row, and

    p = Φ(q),   ṗ = Φ' q̇,   p̈ = Φ' q̈ + Φ'' q̇²,   τ_q = Φ'ᵀ τ_p.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from solver.common.errors import ModelError
from solver.skeleton.functions import (
    Composed,
    Constant,
    CubicSpline,
    CubicTable,
    Linear,
    ScalarFunction,
    simplified,
)
from solver.skeleton.rotations import rotation_about
from solver.skeleton.skeleton import Axis, Joint, Skeleton


@dataclass(frozen=True)
class Fixed:
    """A constant transform: parent from child."""

    R: Float[np.ndarray, "3 3"]
    p: Float[np.ndarray, "3"]  # [m]


@dataclass(frozen=True)
class Moving:
    """A 1-dof joint about or along `axis`, displaced by p[index]."""

    kind: Literal["rotation", "translation"]
    axis: Float[np.ndarray, "3"]  # unit vector
    index: int


@dataclass(frozen=True)
class Chain:
    """The skeleton as elementary steps.

    `steps[i]` leads from the parent body of joint i to body i; `dof[k]` is the free coordinate that drives
    p_k, `body[k]` the first body that p_k moves, and `axis[k]` the number of the axis in that body's joint.
    """

    steps: tuple[tuple[Fixed | Moving, ...], ...]
    functions: tuple[ScalarFunction, ...]
    dof: Int[np.ndarray, " positions"]
    body: Int[np.ndarray, " positions"]
    axis: Int[np.ndarray, " positions"]
    dofs: int

    @property
    def positions(self) -> int:
        """Number of 1-dof joints."""
        return len(self.functions)

    def couple(
        self, q: Float[np.ndarray, "frames dofs"]
    ) -> tuple[
        Float[np.ndarray, "frames positions"],
        Float[np.ndarray, "frames positions"],
        Float[np.ndarray, "frames positions"],
    ]:
        """Φ(q), and the diagonals of its first and second derivative: row k of Φ' is zero but at dof[k].

        Args:
            q: generalized coordinates [rad or m].
        """
        slope, intercept = self._linear
        x = q[:, self.dof]
        value = x * slope + intercept
        first = np.tile(slope, (q.shape[0], 1))
        second = np.zeros_like(first)
        for some, functions in self._curved:
            value[:, some], first[:, some], second[:, some] = functions(x[:, some])
        return value, first, second

    @cached_property
    def _simple(self) -> list[ScalarFunction]:
        return [simplified(function) for function in self.functions]

    @cached_property
    def _linear(self) -> tuple[Float[np.ndarray, " positions"], Float[np.ndarray, " positions"]]:
        """Slopes and intercepts of the linear functions; zero of others."""
        lines = [f if isinstance(f, Linear) else Linear(0.0, 0.0) for f in self._simple]
        return np.array([f.slope for f in lines]), np.array([f.intercept for f in lines])

    @cached_property
    def _curved(self) -> list[tuple[Int[np.ndarray, " some"] | int, ScalarFunction]]:
        """The others, by position: all cubic splines in one, then one by one."""
        splines = {k: f for k, f in enumerate(self._simple) if isinstance(f, CubicSpline)}
        others: list[tuple[Int[np.ndarray, " some"] | int, ScalarFunction]]
        others = [(k, f) for k, f in enumerate(self._simple) if not isinstance(f, Linear | CubicSpline)]
        if not splines:
            return others
        return [(np.array(list(splines)), CubicTable(list(splines.values()))), *others]


def chain_of(skeleton: Skeleton) -> Chain:
    """Compile a skeleton into its chain."""
    return _Compiler(skeleton).chain()


class _Compiler:
    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.coordinates = {c.name: c for c in skeleton.coordinates}
        self.dof_index = {name: i for i, name in enumerate(skeleton.dofs)}
        self.functions: list[ScalarFunction] = []
        self.dof: list[int] = []
        self.body: list[int] = []
        self.axis: list[int] = []

    def chain(self) -> Chain:
        steps = tuple(self._joint(i, joint) for i, joint in enumerate(self.skeleton.joints))
        return Chain(
            steps=steps,
            functions=tuple(self.functions),
            dof=np.array(self.dof, dtype=int),
            body=np.array(self.body, dtype=int),
            axis=np.array(self.axis, dtype=int),
            dofs=len(self.skeleton.dofs),
        )

    def _joint(self, body: int, joint: Joint) -> tuple[Fixed | Moving, ...]:
        steps: list[Fixed | Moving] = [Fixed(joint.R_parent_frame, joint.p_parent_frame)]
        steps += [self._axis(body, number, axis) for number, axis in enumerate(joint.axes)]
        R_frame_child = joint.R_child_frame.T
        steps.append(Fixed(R_frame_child, -R_frame_child @ joint.p_child_frame))
        return _merged(steps)

    def _axis(self, body: int, number: int, axis: Axis) -> Fixed | Moving:
        unit = axis.axis / np.linalg.norm(axis.axis)
        function, dof = self._resolved(axis.function, axis.coordinate)
        if dof is None:
            displacement = float(function(np.zeros(1))[0][0])
            if axis.kind == "rotation":
                return Fixed(rotation_about(unit, np.array([displacement]))[0], np.zeros(3))
            return Fixed(np.eye(3), displacement * unit)
        self.functions.append(function)
        self.dof.append(self.dof_index[dof])
        self.body.append(body)
        self.axis.append(number)
        return Moving(axis.kind, unit, len(self.functions) - 1)

    def _resolved(
        self, function: ScalarFunction, coordinate: str | None
    ) -> tuple[ScalarFunction, str | None]:
        seen: list[str] = []
        while coordinate is not None and not isinstance(function, Constant):
            if coordinate in seen:
                raise ModelError(
                    f"{self.skeleton.name}: coordinates {' → '.join(seen)} are coupled in a circle."
                )
            seen.append(coordinate)
            c = self.coordinates[coordinate]
            if c.locked:
                return Constant(float(function(np.array([c.default]))[0][0])), None
            if c.coupling is None:
                return function, coordinate
            function, coordinate = Composed(function, c.coupling), c.coupled_to
        return function, None


def _merged(steps: Sequence[Fixed | Moving]) -> tuple[Fixed | Moving, ...]:
    """Neighbouring fixed transforms as one."""
    merged: list[Fixed | Moving] = []
    for step in steps:
        last = merged[-1] if merged else None
        if isinstance(step, Fixed) and isinstance(last, Fixed):
            merged[-1] = Fixed(last.R @ step.R, last.p + last.R @ step.p)
        else:
            merged.append(step)
    return tuple(merged)
