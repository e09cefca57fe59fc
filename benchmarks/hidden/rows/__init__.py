"""Methods that answer the public cases, each as a plain submission."""
