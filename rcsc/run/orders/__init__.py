"""Orders from outside: which buffers carry them, scripts of them, and who gives one after the other.

In: a description, signatures, a script. Out: an operator that stands outside the levels: it sends each row with the next
number and waits until the report that repeats the number says done or failed. Any level can be ordered whose superior
stands outside.

>>> from rcsc.lang.restart import NUMBER
>>> from rcsc.run.orders.roles import DONE
>>> NUMBER, DONE
('inc_command', 'done')

Nothing here is trusted for a proof: a level is proved for any order at any moment. What it costs: a comparison a tick.

Source: Haynes et al. 1984, section 9.

Modules, in the order the data flows: `roles` (which buffer carries orders, and which of its fields says what), `numbered`
(an order and its answer), `script` (rows), `operator` (who gives them), `stopped` (a run kept, and gone on with by another
process), `together` (operator and plants as one).
"""
