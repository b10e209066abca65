"""Levels together: what is proved, against the interpreter, enumeration and Spin."""
