"""The numbers of the search, one value object per stage: what is tried, how much of it, and when it is enough."""
