"""One tables file run as two levels, and one output that feeds three of them; `tests/data/two_axes` is the system."""
