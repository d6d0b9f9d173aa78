"""Run `snakemake --lint` and fail on its complaints, less two: that every rule should have a container, and that
functions should stand apart from the rules that alone use them.

The whole study runs in one environment of pinned wheels, so an environment per rule would say the same thing often.
"""

import subprocess
import sys

LEFT_OUT = ("Specify a conda environment or container", "Mixed rules and functions in same snakefile")

command = [sys.executable, "-m", "snakemake", "--lint"]
text = subprocess.run(command, capture_output=True, text=True, check=False)
complaints = []
for line in (text.stdout + text.stderr).splitlines():
    if line.startswith("Lints for "):
        place = line
    elif line.startswith("    * ") and not any(words in line for words in LEFT_OUT):
        complaints.append(f"{place} {line.strip()}")
print("\n".join(complaints) or "snakemake --lint: nothing but containers")
sys.exit(bool(complaints))
