"""Verdicts on trials as they are recorded: the folder is watched, each trial judged, the verdict shown."""
