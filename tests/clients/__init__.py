"""The editors' parts of `grammar/editors`, in the editors themselves."""
