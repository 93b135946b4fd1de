"""The source's own way to a layout, penalty methods from its own starts: what duocell is compared with."""
