"""What is generated: its text, and that interpreter, Python and C agree."""
