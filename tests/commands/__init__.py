"""Commands, documents and the package as a user meets them."""
