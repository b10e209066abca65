"""Tables that are made, kind by kind, and the other tools that decide them beside rcsc."""
