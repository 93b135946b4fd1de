"""What goes over the wire: strict models of requests, descriptions of answers."""
