"""The published tables of `tables/gallery`."""
