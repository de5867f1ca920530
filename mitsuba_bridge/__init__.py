"""The same scene, said in Mitsuba, and Mitsuba's answers."""
