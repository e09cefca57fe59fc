"""A public benchmark of hidden effects: frozen cases, sealed truths, a scorer, rows of three methods."""
