"""Rows, and all that is made of them: tables, figures, files, the report."""
