"""One browser: its session, keys and controls, and how they reach the tabs."""
