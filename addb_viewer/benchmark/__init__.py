"""The benchmark: forces, torques and accelerations from motion alone, on a release's held-out persons."""
