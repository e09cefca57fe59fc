"""What a release holds: the dataset paper's tables and figures, of our frames."""
