"""What commands share.

Options that mean the same have one definition (`options`), and so has what is shown. A report goes out in the form
asked for: text, a line a finding, JSON, SARIF or GitHub's annotations, on standard output or into a file that is
written whole.

A command about a system finds `system.toml` here or in `tables/` (`systems`); what is wrong with it knows its code, and
one place ends the command with that (`rcsc.front.commands.group`). A command that needs an extra says so before its work:

>>> from rcsc.front.commands.shared.extras import EXTRAS
>>> EXTRAS["log"]
('mcap', 'zstandard')

Nothing here is trusted for a verdict, but for `proved`, which says in words what `rcsc prove` found, and `show`,
which says what backs each table.

Modules: `options` has the common options, `paths` the paths that must be there, `extras` the packages that the core leaves
out, `stopped` how a command ends that cannot go on, `systems` what commands about a system need, `graphs` what `rcsc graph`
and `rcsc table` do, `logs` what `rcsc log` and `rcsc replay` do, `cells` makes the paper's cell of a system's data, `show`
puts a report out, `proved` says what `rcsc prove` found, `took` how long its parts took last time, `scaffold`
makes a project of a template or of published tables.
"""
