"""Files that other tools open: OpenSim, B3D, tables, glTF, MuJoCo, C3D."""
