"""What a subject's folder holds, and what belongs together in it."""
