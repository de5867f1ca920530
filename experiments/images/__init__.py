"""Images of others: formats, transfer curves, levels."""
