"""What every panel needs of one browser: what is on its screen, notices, questions, the reviewer."""
