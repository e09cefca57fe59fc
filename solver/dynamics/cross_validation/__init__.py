"""Forces held out from the fit, and how well it predicts them."""
