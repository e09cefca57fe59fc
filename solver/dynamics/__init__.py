"""Joint torques and the residual wrench at the root."""
