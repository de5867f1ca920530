"""The experiments, one a file or folder, listed in `suite`."""
