"""What the commands print for people: tables in millimetres and degrees."""
