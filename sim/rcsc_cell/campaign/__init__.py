"""Campaigns: many episodes of seeds, over any standard executor, kept in a journal, shrunk where a property does not hold.

In: a seed and how many. Out: records in a journal, a summary, and counterexamples as files. An episode's record depends on the
campaign's seed, its number, and the tables and programs alone: not on how many workers there are, nor on the order they end in.
"""
