"""Diagnostics: every form and every page."""
