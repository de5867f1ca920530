"""The front door: what the commands do, as calls whose results show themselves (`nusselt.check`, `nusselt.render`)."""
