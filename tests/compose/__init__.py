"""Levels together: what is proved, against the interpreter and enumeration."""
