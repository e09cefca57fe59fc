"""The 3-D scene: person, forces, plates, and the causes that a diagnosis names."""
