"""How experiments are declared, run, resumed, drawn and written."""
