"""Set the run in a folder of results against the reference run, cell by cell and claim by claim.

python workflow/compare_reference.py [RESULTS]
"""

import sys
from pathlib import Path

from reacher_shaping.analysis.agreement import agreement, compare, compare_verdicts, verdicts_agree
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import ArtifactError, read_table

results = Path(sys.argv[1] if len(sys.argv) > 1 else "results")
try:
    folders = (results, Path("report/reference"))
    runs, kept = (read_table(folder / "runs.parquet", schemas.RUNS) for folder in folders)
    claims = [read_table(folder / "claims.csv", schemas.CLAIMS) for folder in folders]
except ArtifactError as error:
    sys.exit(str(error))
compared = compare(runs, kept)
print(compared.round(4).to_string(index=False))
print(agreement(compared))
verdicts = compare_verdicts(*claims)
print(verdicts.round(2).to_string(index=False))
print(verdicts_agree(verdicts))
