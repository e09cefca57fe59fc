"""Speed and memory: one package, and one way of measuring."""
