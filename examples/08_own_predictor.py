"""8. A predictor of your own for the benchmark: linear regression from the legs' angles to the feet's forces.

addb-viewer dataset split RELEASE      # once: who trains, and who judges
addb-viewer benchmark evaluate RELEASE --predictor examples/08_own_predictor.py:Regression
"""

import numpy as np

from addb_viewer.benchmark.task import Predicted

JOINTS = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
LEGS = [f"{joint}_{side}" for side in "rl" for joint in JOINTS]


class Regression:
    name = "regression"

    def fit(self, train, dev, log):
        squares, products = 1e-3 * np.eye(2 * len(LEGS) + 1), 0.0
        for example in train:
            counts = example.measured.counts
            x, y = self.inputs(example.seen)[counts], example.measured.force[counts] / example.seen.mass_kg
            squares, products = squares + x.T @ x, products + x.T @ y.reshape(len(y), 6)
        self.weights = np.linalg.solve(squares, products)

    def predict(self, seen):
        force = (self.inputs(seen) @ self.weights).reshape(-1, 2, 3) * seen.mass_kg
        return Predicted(force, np.zeros_like(force))

    def inputs(self, seen):
        q = seen.q[:, [seen.skeleton.dofs.index(name) for name in LEGS]]
        return np.hstack([q, np.gradient(q, 1 / seen.rate, axis=0), np.ones((len(q), 1))])
