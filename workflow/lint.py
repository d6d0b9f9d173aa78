"""Run `snakemake --lint` and fail on its complaints, less one: that every rule should have a container.

The whole study runs in one environment of pinned wheels, so an environment per rule would say the same thing often.
"""

import subprocess
import sys

LEFT_OUT = "Specify a conda environment or container"

command = [sys.executable, "-m", "snakemake", "--lint"]
text = subprocess.run(command, capture_output=True, text=True, check=False)
complaints = []
for line in (text.stdout + text.stderr).splitlines():
    if line.startswith("Lints for "):
        place = line
    elif line.startswith("    * ") and LEFT_OUT not in line:
        complaints.append(f"{place} {line.strip()}")
print("\n".join(complaints) or "snakemake --lint: nothing but containers")
sys.exit(bool(complaints))
