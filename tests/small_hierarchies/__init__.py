"""Small hierarchies drawn by seed and enumerated: the judge of `tests.hierarchies`."""
