"""What is shown to people: of a run, pages, pictures, exports; of what rcsc costs, the drawing."""
