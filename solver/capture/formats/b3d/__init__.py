"""B3D, the format of the AddBiomechanics Dataset: what a file holds, and such a file as a subject."""
