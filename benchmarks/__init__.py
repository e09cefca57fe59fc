"""Speed and accuracy figures on real recordings, side by side with OpenSim where it can be installed."""
