"""FRET's formulas, evaluated: past time on finite traces, future time on endless ones; nothing is shared with rcsc."""
