"""What commands share.

Options that mean the same have one definition (`options`), and so has what is shown. A report goes out in the form
asked for: text, a line a finding, JSON, SARIF or GitHub's annotations, on standard output or into a file that is
written whole.

A command about a system finds `system.toml` here or in `tables/` and turns what is wrong with it into a coded error
(`systems`). A command that needs an extra says so before its work:

>>> from rcsc.commands.shared.extras import EXTRAS
>>> EXTRAS["log"]
('mcap', 'zstandard')

Nothing here is trusted for a verdict, but for `proved`, which says in words what `rcsc prove` found, and `show`,
which says what backs each table.

Modules: `options` has the common options, `extras` the packages that the core leaves out, `systems` what commands
about a system need and `rcsc db`, `show` puts a report out, `proved` what `rcsc prove` says, `pages` what `rcsc
explain` prints, `drawn` finds the cell that a log is drawn in.
"""
