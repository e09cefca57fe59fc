"""The review app: one trial at a time in the browser, as a scene, plots and keys."""
