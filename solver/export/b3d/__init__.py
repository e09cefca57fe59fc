"""B3D, the format of the AddBiomechanics Dataset: writer, and a fit as such a file."""
