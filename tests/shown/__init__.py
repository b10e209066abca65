"""What is shown of a run to people: pages, pictures, exports."""
