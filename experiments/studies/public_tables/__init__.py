"""Public tables of direct light: what they print, what is right, what ours and Mitsuba say."""
