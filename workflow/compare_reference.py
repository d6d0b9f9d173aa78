"""Set the run in a folder of results against the reference run, cell by cell.

python workflow/compare_reference.py [RESULTS]
"""

import sys
from pathlib import Path

from reacher_shaping import artifacts, reference, schemas

results = Path(sys.argv[1] if len(sys.argv) > 1 else "results")
try:
    runs, kept = (
        artifacts.read_table(folder / "runs.parquet", schemas.RUNS) for folder in (results, Path("report/reference"))
    )
except artifacts.ArtifactError as error:
    sys.exit(str(error))
compared = reference.compare(runs, kept)
print(compared.round(4).to_string(index=False))
print(reference.agreement(compared))
