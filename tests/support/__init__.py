"""What tests of several rooms share: programs, cells, strategies."""
