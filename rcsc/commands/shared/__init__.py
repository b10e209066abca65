"""What commands share.

`options` has their common options, `systems` what those about a system need and `rcsc db`, `show` puts a report out in the form asked
for, `proved` what `rcsc prove` says, `pages` what `rcsc explain` prints, `drawn` finds the cell that a log is drawn in.
"""
