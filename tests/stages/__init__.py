"""Several tables in a level's cycle: language, executors, proof, and everything that shows them."""
