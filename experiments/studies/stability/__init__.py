"""The closed forms and whole images where textbooks lose everything."""
