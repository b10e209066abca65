"""Which numbers nobody has set since a run began: what a picture leaves out, and an export leaves empty.

A number without an initial value of its own starts at 0, because it has to start with something: a pose starts in the middle of the
plate, where no robot ever was. It is *unset* until

- its value is another than at first;
- a line ran that may write it, or a procedure that its level runs in each cycle may;
- for an input: its buffer was published by who stands outside, or by a level that had set it; or the database answered.

So a number is called unset only where nobody can have written it, and not because it is 0: a line that
writes just that sets it, too. What is written in the tables' own words has a meaning from the start, and is never unset: members of
enumerations, bools, and what has an initial value. A run that goes on from a state of another, and a log from before symbol
files said what may set a number, have nothing that is unset.

>>> from rcsc.run.unset.since import Unsets
>>> Unsets((), {}).now
{}

Modules: `since`.
"""
