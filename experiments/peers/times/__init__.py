"""Error against time: every renderer on one scene, turn by turn, one thread each."""
