"""The pages as a site with search, by MkDocs and its theme Material: `python -m tests.site` writes it to `build/site`."""
