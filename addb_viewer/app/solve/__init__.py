"""The Solve tab: solve again, compare, keep or discard."""
