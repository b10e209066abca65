"""The studio: tables, their proof, the running levels and the cell in one page, on this machine. Needs the extra `studio`.

    rcsc studio my_robot

prints an address with a token that cannot be guessed. The page asks, *concerns* answer (`hub`): each in the lane that it names, one
thread a lane, so that a proof does not hold the levels up and no concern needs a lock. Answers and events wait for each page within
bounds, and a page that hangs holds nobody up.

>>> from rcsc.desk.studio.hub import message
>>> message(id=1, answer={"tick": 5, "speed": float("inf")})
'{"id":1,"answer":{"tick":5,"speed":"inf"}}'

A new concern is a class with `name`, `lane`, a method `_on_VERB` for each kind of question, and perhaps `greeting`, `begin` and `close`,
and a line in `project`; a new view is a module of
`page/` with `mount(root, bus)` and a row in `page/views.js`.

Nothing that a page sends is run or compiled but through the shell's commands and the prover. Who may see it: `rcsc.base.host.guard`.

Modules, in the order the data flows: `server` talks to pages, `hub` has their questions answered, `project` says by whom; `build`
has tables and levels proved in processes of their own, `required` lists requirements as they stand; `runs` is the running system
and its time line, `tables` the open files with their grids, proof and graphs; `scene` shows what stands outside the levels, `plots`
variables over time, `share` hands files on; `start` says what else may be opened. The folder `page` is the page, `page/vendor`
parts of others with their licences.
"""
