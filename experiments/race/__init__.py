"""Error against time, ours and Mitsuba's: measured here, told by `experiments.error_against_time`."""
