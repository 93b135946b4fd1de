"""Joint angles over boxes of base positions: enclosures, slopes, and how much the slopes can bend."""
