"""The editor's answers: the same as those of `rcsc check`, repairs that mend, texts of every kind."""
