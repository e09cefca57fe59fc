"""Every command as somebody types it."""

from typer.main import get_command

from addb_viewer.commands.cli import app

# {s} is the subject's folder, {o} one beside it.
TYPED = {
    "ablation": "{s} --repetitions 1",
    "accept": "{s}",
    "agreement": "{s} anna ben",
    "convert": "{s}/trials/walk/markers.trc {o}/walk.c3d",
    "demo": "--folder {s} --no-serve",
    "detect": "{s}",
    "diagnose": "{s}",
    "export": "{s} --to csv --to c3d --to b3d --trial walk",
    "fit": "{s}",
    "flag": "{s} walk 20:30 --reason manualReview",
    "flags": "{s}",
    "init": "{s}",
    "label": "{s} {o}/labels.csv",
    "mark": "{s} walk finished --undecided-stay-out",
    "markers": "{s}",
    "open": "{s} --port 0",
    "record": "{s} --mcap {o}/walk.mcap --trial walk",
    "redo": "{s} walk --author anna",
    "reject": "{s}",
    "report": "{s} --diagnose",
    "settings": "{s}",
    "share": "{s}",
    "undo": "{s} walk --author anna",
    "watch": "{s} --port 0",
    "dataset build": "{s} --out {o}/release",
    "dataset check": "{s}",
    "dataset show": "{s}",
    "dataset split": "{s}",
    "dataset stats": "{s} --out {o}/stats",
    "dataset synthesize": "--out {o}/corpus --persons 1",
    "benchmark evaluate": "{s}",
    "benchmark sweep": "{s}",
    "benchmark table": "{s}",
    "benchmark train": "{s}",
}


def _commands(group, before=""):
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, f"{before}{name} ")
        else:
            yield f"{before}{name}", command.loaded()


COMMANDS = dict(_commands(get_command(app)))  # by their words, those of groups too
