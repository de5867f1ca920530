"""Exact shadows on random scenes: against twins that must agree, and two referees that share no code with them.

`--scenes N` says how many; `--scenes KIND-NUMBER` or a file examines one scene with every twin.
"""

from __future__ import annotations

from nusselt.experiments.runs.experiment import Experiment
from nusselt.experiments.search.batches import SCENES, search_jobs
from nusselt.experiments.search.tables import search_figures, search_files, search_page, search_table

RANDOM_SCENES = Experiment(
    "random-scenes",
    "exact shadows on random scenes full of ties, against exact twins and two independent referees",
    search_jobs,
    search_figures,
    scenes=(SCENES,),
    table=search_table,
    text=search_page,
    files=search_files,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(RANDOM_SCENES)
