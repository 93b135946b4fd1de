"""The processes that solve, and the server's side of them."""
