"""What every room of the service may use: problems and issues, numbers and moments, names of routes."""
