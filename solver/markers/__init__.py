"""What laboratories call their markers, and where on the body such a marker sits."""
