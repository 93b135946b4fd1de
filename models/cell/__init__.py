"""A cell: its task, its arms, what stands around them, and what ties their bases."""
