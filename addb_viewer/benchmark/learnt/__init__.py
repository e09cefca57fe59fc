"""Predictors that learn, with PyTorch: the only room that knows it."""
