"""Predictors that learn, with PyTorch: the only package that knows it."""
