"""Small levels drawn by seed, of every kind that a requirement over time can meet, and the proof of each against all of its runs.

Modules: `drawn` (a level as text), `truth` (every run, by functions made of its program), `held` (what is proved, found and shown, against
that), `__main__` (many, by a command).
"""
