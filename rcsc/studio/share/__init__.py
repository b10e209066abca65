r"""What is handed on: a moment of a run with the ticks around it, or a finding, as one HTML file that needs nothing else.

    ask("share.moment", {"tick": 70, "around": 200})     the ticks 0 to 270, which are scrubbed in the file
    ask("handed.finding", {"file": ..., "version": ..., "finding": 0})     the table with its witness as a row and a column

>>> from rcsc.studio.share.document import script
>>> script("// one\nimport { a } from './b.js';\nexport const c = 1;\n")
'// one\nconst c = 1;\n'

A file has one script, the one that draws it, named by its hash in the policy (`rcsc.pages`); what is drawn stands in it as data. Files
say what is known of what they show, and rest on nothing that is elsewhere. What it costs: a moment with 200 ticks on both sides is some
hundred kilobytes without pictures, and at most twelve megabytes with them.

Modules, in the order the data flows: `film` gathers ticks, `document` makes a page of them or of a finding, `sharing` answers.
"""
