"""Long searches that know nothing of duocell's."""
