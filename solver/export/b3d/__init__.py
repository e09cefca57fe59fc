"""B3D, the release format of the AddBiomechanics Dataset: reader, writer, and a fit as such a file."""
