"""Words for people: why an arm cannot do its part of the task, and what is wrong with a given layout."""
