"""The language: text to tree, tree to model, and what a model means."""
