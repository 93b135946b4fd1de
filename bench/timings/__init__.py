"""How long things take: solves, answers over HTTP, load, old and new versions by turns."""
