"""Building a release in a test."""

from addb_viewer.dataset.build import Plan, planned
from addb_viewer.dataset.build_task import read_task
from addb_viewer.dataset.release_subject import BuildOptions, Terms
from addb_viewer.dataset.subject_task import run_task

TERMS = Terms("Lab", "CC0-1.0", "public")
ALL = BuildOptions(TERMS, unreviewed=True)


def planned_apart(walks, options=ALL):
    """Each folder planned by itself: they hold the same steps, of which a plan of both takes one."""
    plans = [planned([folder], options) for folder in sorted(walks.iterdir())]
    return Plan(tuple(one for plan in plans for one in plan.subjects), ())


class Here:
    """An engine that works in this process, on tasks that went through a file as those of others do."""

    def __init__(self):
        self.did = []

    def run(self, tasks, do, done):
        for task in tasks:
            self.did.append(task.who.subject_id)
            file = task.out.with_suffix(".json")
            task.write(file)
            done(task, run_task(read_task(file)))
            file.unlink()
