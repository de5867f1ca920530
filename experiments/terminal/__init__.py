"""What commands share: options, progress, one line for what a user got wrong."""
