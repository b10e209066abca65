"""The cell: plants, vision, workstation, pictures, and what would be cheating."""
