"""The paper's two networks, and training as it states it.

Each epoch ends in a checkpoint from which a killed run goes on alike.
"""

import hashlib
import os
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from addb_viewer.benchmark.learnt.training_windows import LENGTH, TARGETS, Windows
from addb_viewer.benchmark.task import BenchmarkError, Log

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


CHECKPOINT = "checkpoint.pt"
EVALUATED_AT_ONCE = 1024  # windows


@dataclass(frozen=True)
class Start:
    """Weights of an earlier training, of whatever persons."""

    weights: dict[str, Tensor]  # scales included: features mean to them what they meant there
    persons: frozenset[str]  # that it knows

    @property
    def fingerprint(self) -> str:
        """Another one for other weights."""
        digest = hashlib.sha256()
        for name, value in sorted(self.weights.items()):
            digest.update(name.encode() + value.cpu().numpy().tobytes())
        return digest.hexdigest()


@dataclass(frozen=True)
class Data:
    """What is learnt from."""

    fingerprint: str
    persons: frozenset[str]  # who train, and who choose


@dataclass(frozen=True)
class TrainingSettings:
    """The paper's supplement: RMSprop, 1e-4, 32, 10. The loss is our choice, since the paper names none."""

    learning_rate: float = 1e-4
    batch: int = 32
    epochs: int = 10
    seed: int = 0


def trained(
    network: Scaled,
    train: Windows,
    dev: Windows,
    *,
    settings: TrainingSettings,
    log: Log,
    data: Data,
    start: Start | None = None,
) -> Scaled:
    """The network with the weights of its best epoch by the dev persons' loss; without any, of the last.

    Single-threaded on the processor, so that equal seeds give equal weights. Every epoch's order and dropout
    follow from seed and epoch alone.

    Args:
        network: with its first weights.
        train: windows to learn from; their scales are the network's.
        dev: windows to choose the epoch by.
        settings: of the training.
        log: has the folder where the checkpoint lies.
        data: a checkpoint of other data begins anew.
        start: to go on from; its own weights are kept where no epoch does better on the dev persons.

    Raises:
        BenchmarkError: there is nothing to learn from.
    """
    if not len(train):
        raise BenchmarkError(
            "no frame of the training persons can be learnt from; a window needs 46 that count"
        )
    torch.use_deterministic_algorithms(True)
    torch.set_num_threads(1)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    network.load_state_dict(
        start.weights if start else {name: torch.from_numpy(v) for name, v in train.scales().items()},
        strict=start is not None,
    )
    network.to(device)
    optimizer = torch.optim.RMSprop(network.parameters(), lr=settings.learning_rate)
    terms = {"settings": asdict(settings), "data": data.fingerprint, "network": str(network.body)}
    if start:
        terms["start"] = start.fingerprint
    kept = _resumed(log.folder / CHECKPOINT, terms, network, optimizer)
    kept["persons"] = sorted(data.persons | (start.persons if start else frozenset()))
    if start and not kept["epoch"] and len(dev):
        kept |= {"best_loss": _loss(network, dev), "best": dict(start.weights)}
    for epoch in range(kept["epoch"], settings.epochs):
        loss = _epoch(network, optimizer, train, settings, epoch)
        dev_loss = _loss(network, dev) if len(dev) else float("nan")
        best = not len(dev) or dev_loss < kept["best_loss"]
        kept |= {"epoch": epoch + 1, "network": network.state_dict(), "optimizer": optimizer.state_dict()}
        if best:
            kept |= {"best_loss": dev_loss, "best": {k: v.clone() for k, v in network.state_dict().items()}}
        _save(kept, log.folder / CHECKPOINT)
        log(epoch=epoch + 1, train_loss=loss, dev_loss=dev_loss)
    network.load_state_dict(kept["best"])
    return network.eval()


def start_of(path: Path) -> Start:
    """The weights that a training kept.

    Args:
        path: of its checkpoint.

    Raises:
        BenchmarkError: it has none, or does not say whom it knows.
    """
    kept = torch.load(path, weights_only=True, map_location="cpu")
    if not {"best", "persons"} <= set(kept):
        raise BenchmarkError(f"{path}: no training that can be gone on from; train anew")
    return Start(kept["best"], frozenset(kept["persons"]))


def told(network: Scaled, windows: np.ndarray) -> np.ndarray:
    """Targets of many windows.

    Args:
        network: trained.
        windows: (windows, length, features).
    """
    device = next(network.parameters()).device
    pieces = []
    with torch.no_grad():
        for start in range(0, len(windows), EVALUATED_AT_ONCE):
            some = _tensor(windows[start : start + EVALUATED_AT_ONCE], device)
            pieces.append(network.unscaled(network(some)).cpu().numpy())
    return np.concatenate(pieces).astype(float)


def _epoch(
    network: Scaled,
    optimizer: torch.optim.Optimizer,
    train: Windows,
    settings: TrainingSettings,
    epoch: int,
) -> float:
    """Mean loss while learning."""
    network.train()
    device = next(network.parameters()).device
    order = np.random.default_rng([settings.seed, epoch]).permutation(len(train))
    torch.manual_seed(settings.seed * 1_000_003 + epoch)
    total = 0.0
    for start in range(0, len(order), settings.batch):
        windows, targets = (_tensor(a, device) for a in train.some(order[start : start + settings.batch]))
        loss = torch.nn.functional.mse_loss(network(windows), network.scaled(targets))
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        total += loss.item() * len(windows)
    return total / len(order)


def _loss(network: Scaled, dev: Windows) -> float:
    network.eval()
    device, total = next(network.parameters()).device, 0.0
    with torch.no_grad():
        for start in range(0, len(dev), EVALUATED_AT_ONCE):
            some = np.arange(start, min(start + EVALUATED_AT_ONCE, len(dev)))
            windows, targets = (_tensor(a, device) for a in dev.some(some))
            off = network(windows) - network.scaled(targets)
            total += float((off**2).mean(dim=1).sum())
    return total / len(dev)


def _tensor(values: np.ndarray, device: torch.device) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32)).to(device)


def _resumed(
    path: Path, terms: dict[str, Any], network: Scaled, optimizer: torch.optim.Optimizer
) -> dict[str, Any]:
    """Where an earlier run of the same terms has come to, loaded into network and optimizer."""
    if path.is_file():
        kept: dict[str, Any] = torch.load(path, weights_only=True)
        if kept["terms"] == terms:
            network.load_state_dict(kept["network"])
            optimizer.load_state_dict(kept["optimizer"])
            return kept
    return {"terms": terms, "epoch": 0, "best_loss": float("inf")}


def _save(kept: dict[str, Any], path: Path) -> None:
    partial = path.with_suffix(".partial")
    torch.save(kept, partial)
    os.replace(partial, path)
