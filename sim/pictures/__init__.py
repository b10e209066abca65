"""Pictures of the cell, all SVG text: the solid one of a MuJoCo model, the stick figure of section 10, plots; and pages of them."""
