"""State graphs, both ways."""
