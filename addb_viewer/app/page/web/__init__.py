"""What the app adds to viser's page: scripts and styles of its own, served as files."""
