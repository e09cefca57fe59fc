"""Files that other tools open: OpenSim."""
