"""A network as a predictor."""

from collections.abc import Callable

import torch
from torch import nn

from addb_viewer.benchmark.learnt.features import features_of, wrenches_of
from addb_viewer.benchmark.learnt.networks import GroundLinkNet, Scaled, mlp
from addb_viewer.benchmark.learnt.training import TrainingSettings, told, trained
from addb_viewer.benchmark.learnt.windows import ends_of_all, windows_of
from addb_viewer.benchmark.task import Foretold, Log, Seen, Trials


class Learnt:
    """Learns forces and moments on the feet from windows of motion."""

    def __init__(self, name: str, network: Callable[[], nn.Module], settings: TrainingSettings) -> None:
        """Untrained.

        Args:
            name: of the predictor.
            network: makes it, with weights drawn at random.
            settings: of the training.
        """
        self.name, self.make, self.settings = name, network, settings
        self.network: Scaled | None = None

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Train, or go on where the folder's checkpoint is."""
        torch.manual_seed(self.settings.seed)
        self.network = trained(
            Scaled(self.make()),
            windows_of(train, log.folder / "train"),
            windows_of(dev, log.folder / "dev"),
            settings=self.settings,
            log=log,
            data=f"{train.fingerprint} {sorted(train.persons)} {sorted(dev.persons)}",
        )

    def predict(self, seen: Seen) -> Foretold:
        """The last frames of windows; at a stretch's beginning its first frame stands for those before."""
        assert self.network is not None, "fit comes first"
        features, pose = features_of(seen)
        force, moment = wrenches_of(told(self.network, features[ends_of_all(seen.frames)]), seen, pose)
        return Foretold(force, moment)


def learnt(name: str, settings: TrainingSettings = TrainingSettings()) -> Learnt:  # noqa: B008 (frozen)
    """The paper's networks.

    Args:
        name: "mlp" or "groundlinknet".
        settings: of the training.
    """
    return Learnt(name, mlp if name == "mlp" else GroundLinkNet, settings)
