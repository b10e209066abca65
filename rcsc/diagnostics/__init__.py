"""What is wrong, as data, and how it is shown.

A *diagnostic* has a code, a span in a source text, labels, help and a witness. Modules, in the order the data flows: `source` (named
texts and spans), `codes` and `explanations` (what each code means), `diagnostic`, `report` (what a command found); then the forms of a
report: `render` (text; `printable` makes user text safe), `jsonform`, `github`, `sarif`.
"""
