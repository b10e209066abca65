"""What is not proved, shown: runs that the interpreter and the executors did.

`simplest` finds the simplest model, `trace` the shortest run that breaks an obligation, `lasso` one that goes round, `pair` one of two
levels together; each becomes a `finding`. `replay` runs it by the executors and keeps a log, `frozen` keeps it as a case, `repair` says
what would mend the table; `explain` goes through all that is open.
"""
