"""The processes of `labctl serve`: a supervisor, the bench process, and the web process."""
