"""Error against time, ours and Mitsuba's: measured here, told by `nusselt.experiments.studies.race.study`."""
