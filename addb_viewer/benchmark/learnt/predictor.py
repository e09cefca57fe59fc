"""A network as a predictor."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import nn

from addb_viewer.benchmark.learnt.training import (
    CHECKPOINT,
    Data,
    GroundLinkNet,
    Scaled,
    Start,
    TrainingSettings,
    mlp,
    start_of,
    told,
    trained,
)
from addb_viewer.benchmark.learnt.training_windows import (
    SIZES,
    Features,
    ends_of_all,
    features_of,
    windows_of,
    wrenches_of,
)
from addb_viewer.benchmark.scoring import ErrorBands, error_bands
from addb_viewer.benchmark.task import BenchmarkError, Log, Predicted, Seen, Trials

NETWORKS: dict[str, Callable[[int], nn.Module]] = {"mlp": mlp, "groundlinknet": GroundLinkNet}


@dataclass
class Learnt:
    """Learns forces and moments on the feet from windows of motion."""

    name: str
    make: Callable[[int], nn.Module]  # of the number of features, with weights drawn at random
    settings: TrainingSettings
    features: Features = "plain"
    start: Start | None = None
    network: Scaled | None = None
    bands: ErrorBands | None = None

    @property
    def knows(self) -> frozenset[str]:
        """Persons whom it has met before `fit`."""
        return self.start.persons if self.start else frozenset()

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Train, or go on where the folder's checkpoint is."""
        torch.manual_seed(self.settings.seed)
        self.network = trained(
            Scaled(self.make(SIZES[self.features]), SIZES[self.features]),
            windows_of(train, log.folder / "train", self.features),
            windows_of(dev, log.folder / "dev", self.features),
            settings=self.settings,
            log=log,
            data=_data(train, dev),
            start=self.start,
        )
        self.bands = error_bands(lambda example: self._answer(example.seen), dev if dev.persons else train)

    def predict(self, seen: Seen) -> Predicted:
        """The last frames of windows; at a stretch's beginning its first frame stands for those before."""
        predicted = self._answer(seen)
        if self.bands is None:
            return predicted
        return replace(predicted, force_sd=self.bands.of(predicted.force, seen.mass_kg))

    def _answer(self, seen: Seen) -> Predicted:
        assert self.network is not None, "fit comes first"
        rows, pose = features_of(seen, self.features)
        force, moment = wrenches_of(told(self.network, rows[ends_of_all(seen.frames)]), seen, pose)
        return Predicted(force, moment)


def learnt(
    name: str,
    settings: TrainingSettings = TrainingSettings(),  # noqa: B008 (frozen)
    *,
    features: Features = "plain",
    start: Path | None = None,
) -> Learnt:
    """The paper's networks; their names say what is not the paper's.

    Args:
        name: "mlp" or "groundlinknet".
        settings: of the training.
        features: of each frame.
        start: results of an evaluation whose training is gone on from; None: from random weights.

    Raises:
        BenchmarkError: no training of that predictor lies in `start`, or several.
    """
    whole = name if features == "plain" else f"{name}-{features}"
    begun = None if start is None else start_of(_checkpoint(start, whole))
    return Learnt(whole if begun is None else f"{whole}-started", NETWORKS[name], settings, features, begun)


def _checkpoint(results: Path, name: str) -> Path:
    found = sorted((results / "work" / name).rglob(CHECKPOINT))
    if len(found) != 1:
        raise BenchmarkError(
            f"{results}: {len(found)} trainings of {name} in work/{name}, but one is wanted to start from: "
            "evaluate or train it there, with one part tested"
        )
    return found[0]


def _data(train: Trials, dev: Trials) -> Data:
    fingerprint = f"{train.fingerprint} {sorted(train.persons)} {sorted(dev.persons)}"
    return Data(fingerprint, train.persons | dev.persons)
