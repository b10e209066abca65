"""Lines that match together: which goes before (`above`), which do the same (`same`)."""
