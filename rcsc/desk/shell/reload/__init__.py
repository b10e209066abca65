"""New tables for a level that runs.

A level may take new tables where it stands only if three things hold, in this order: they prove; the present state
lies in the ranges and invariants that were proved; and the next cycle, from this state and with what the buffers
hold, does what it did before. The next cycle is run on both executors and both are put back; what later cycles can
come to is shown by `diff`, in table words. `anyway` takes tables that do otherwise; nothing takes tables that do not
prove.

    > diff task               what the edited tables do otherwise; nothing is taken
    > reload task             takes them, if all three hold
    > reload task proved      and only if the levels together are proved with them

Tables that `rcsc prove` found not to be proved with their neighbours stay out; where nobody looked, it says so. A
state has to fit leaf by leaf: a leaf that is new begins at its initial value, one that is gone is told.

>>> from rcsc.base.diagnostics.coded import CodedError, Refused
>>> issubclass(Refused, CodedError)
True

Trusted: as for `rcsc check`, and `diff`. What it costs: a proof of the level, and one comparison.

Modules, in the order the data flows: `reload` keeps what the running tables say, and proves and compiles new ones,
`gate` decides whether the level may take them where it stands, `composed` says what is known of them with their
neighbours.
"""
