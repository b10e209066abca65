"""Traceability of tables, generated code, tests and requirements."""
