"""How well activities are suggested, and what learns the weights: `python -m benchmarks.activities`."""
