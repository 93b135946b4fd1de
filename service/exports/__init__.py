"""Files made of a finished layout, on the command line and over HTTP: each kind is a file and a line in `exports`."""
