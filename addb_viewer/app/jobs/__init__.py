"""Work in processes of its own: fits, solves, diagnoses, recordings, what-if questions."""
