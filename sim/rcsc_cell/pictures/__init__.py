"""Pictures of the cell, all SVG text, and pages of them.

`solid` draws a MuJoCo model (`shapes`, `order`), `stick` the stick figure of section 10 (`views`, `things`), `plot` a value over time.
`scene` finds in a log where everything is; `finding_page` and `report` are pages (`page`).
"""
