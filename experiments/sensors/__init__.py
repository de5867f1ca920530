"""Points that measure irradiance: read by ours and by Mitsuba, and judged against each other and what is expected."""
