"""Whole systems drawn at random, and every claim that is proved of them held against what can happen to them."""
