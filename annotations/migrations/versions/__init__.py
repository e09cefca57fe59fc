"""The steps, each with the number of the one before it; a step that has been released stays as it is."""
