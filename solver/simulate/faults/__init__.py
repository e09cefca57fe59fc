"""Hides causes of residuals in recordings. Knows nothing of who looks for them."""
