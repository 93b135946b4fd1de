"""Tasks as people have them: tables, lists, robot programs and tool paths become poses."""
