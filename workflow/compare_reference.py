"""Set the run in a folder of results against the reference run, cell by cell.

python workflow/compare_reference.py [RESULTS]
"""

import sys
from pathlib import Path

from reacher_shaping.analysis.agreement import agreement, compare
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import ArtifactError, read_table

results = Path(sys.argv[1] if len(sys.argv) > 1 else "results")
try:
    runs, kept = (read_table(folder / "runs.parquet", schemas.RUNS) for folder in (results, Path("report/reference")))
except ArtifactError as error:
    sys.exit(str(error))
compared = compare(runs, kept)
print(compared.round(4).to_string(index=False))
print(agreement(compared))
