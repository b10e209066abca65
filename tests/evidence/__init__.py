"""Evidence of the generated C: what each tool shows, and that it tells of a planted fault."""
