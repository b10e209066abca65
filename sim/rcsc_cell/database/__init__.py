"""The cell's database: one SQLite file, made of a readable data file, asked by the levels through their feeds."""
