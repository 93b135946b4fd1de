"""What every room of the service may use: problems and issues, numbers and timestamps, names of routes."""
