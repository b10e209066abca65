"""The emitted C as one who reads, links and signs it meets it: its words, names, sizes and places."""
