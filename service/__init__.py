"""duocell over HTTP and on a command line."""
