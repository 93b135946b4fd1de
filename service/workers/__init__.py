"""The processes that solve, read large requests and read uploads, and the server's side of them."""
