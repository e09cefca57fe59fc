"""What every engine does."""

from collections.abc import Callable, Sequence
from typing import Protocol

from addb_viewer.dataset.receipts import Receipt
from addb_viewer.dataset.task import Task

Done = Callable[[Task, Receipt], None]

ATTEMPTS = 3  # of a task whose worker dies, or whose disk fails


class Engine(Protocol):
    """Does tasks; what they make lies on the disk, and a receipt says so."""

    def run(self, tasks: Sequence[Task], done: Done) -> None:
        """Do all tasks, in any order; an error of the data is a receipt too.

        Args:
            tasks: to be done.
            done: told of each as it ends, in the caller's thread.

        Raises:
            ReleaseError: the disk fails again and again.
        """
        ...
