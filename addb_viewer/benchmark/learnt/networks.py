"""The paper's two networks."""

from itertools import pairwise

import torch
from torch import Tensor, nn

from addb_viewer.benchmark.learnt.features import TARGETS
from addb_viewer.benchmark.learnt.windows import LENGTH

HIDDEN = 512  # nodes of each of the MLP's two layers (the paper's supplement)
CHANNELS, KERNEL = (128, 128, 256, 256), 7  # of GroundLinkNet's convolutions (Han et al. 2023)
DENSE, DROPOUT = 256, 0.2


class Scaled(nn.Module):
    """A network between the scales of the training data: a batch of windows in, targets out."""

    def __init__(self, body: nn.Module, features: int) -> None:
        """Scales are those of nothing yet.

        Args:
            body: takes scaled windows, gives scaled targets.
            features: of a frame.
        """
        super().__init__()
        self.body = body
        for name, size in (("feature", features), ("target", TARGETS)):
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_std", torch.ones(size))

    def forward(self, windows: Tensor) -> Tensor:
        """Targets of the last frame, scaled: mean 0, deviation 1 over the training windows."""
        told: Tensor = self.body((windows - self.feature_mean) / self.feature_std)
        return told

    def scaled(self, targets: Tensor) -> Tensor:
        """Targets as `forward` gives them."""
        scaled: Tensor = (targets - self.target_mean) / self.target_std
        return scaled

    def unscaled(self, told: Tensor) -> Tensor:
        """The way back."""
        targets: Tensor = told * self.target_std + self.target_mean
        return targets


def mlp(features: int, hidden: int = HIDDEN) -> nn.Module:
    """Two hidden layers with sigmoid.

    Args:
        features: of a frame.
        hidden: nodes of each.
    """
    return nn.Sequential(
        nn.Flatten(),
        nn.Linear(LENGTH * features, hidden),
        nn.Sigmoid(),
        nn.Linear(hidden, hidden),
        nn.Sigmoid(),
        nn.Linear(hidden, TARGETS),
    )


class GroundLinkNet(nn.Module):
    """Convolutions over time, then dense layers on the last frame."""

    def __init__(self, features: int) -> None:
        """With weights drawn at random.

        Args:
            features: of a frame.
        """
        super().__init__()
        sizes = (features, *CHANNELS)
        convolutions: list[nn.Module] = []
        for before, after in pairwise(sizes):
            convolutions += [
                nn.Conv1d(before, after, KERNEL, padding=KERNEL // 2, padding_mode="replicate"),
                nn.ELU(),
            ]
        self.convolutions = nn.Sequential(*convolutions)
        self.dense = nn.Sequential(
            nn.Dropout(DROPOUT),
            nn.Linear(CHANNELS[-1], DENSE),
            nn.ELU(),
            nn.Dropout(DROPOUT),
            nn.Linear(DENSE, DENSE),
            nn.ELU(),
            nn.Linear(DENSE, TARGETS, bias=False),
        )

    def forward(self, windows: Tensor) -> Tensor:
        """Of a batch of windows (batch, length, features)."""
        told: Tensor = self.dense(self.convolutions(windows.transpose(1, 2))[:, :, -1])
        return told
