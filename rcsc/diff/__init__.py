"""What changed between two versions of the tables: where, in table words, and the proof that nothing else did."""
