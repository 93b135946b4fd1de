"""Whether an arm can go the whole way of a task, not only take its poses."""
