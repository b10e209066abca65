"""Pictures of the cell: the solid one of a MuJoCo model, the stick figure of section 10, plots; all of them SVG text."""
