"""Retrain the reference run's smallest block and say whether its weights have the published checksum.

python workflow/check_bits.py [bits.json]
"""

import json
import sys
import tempfile
from pathlib import Path

from reacher_shaping import processor

processor.fix()  # before NumPy is imported

from reacher_shaping.jobs import training_job  # noqa: E402
from reacher_shaping.settings.cell import Cell  # noqa: E402
from reacher_shaping.storage.files import ArtifactError, read_json  # noqa: E402
from reacher_shaping.storage.policy_format import weights_checksum  # noqa: E402
from reacher_shaping.storage.provenance import machine, versions  # noqa: E402

DECISIVE = ("mujoco", "numpy", "torch")
"""Packages whose version decides a training's bits."""


def main() -> int:
    published = read_json(Path(sys.argv[1] if len(sys.argv) > 1 else "report/reference/bits.json"))
    cell = Cell.model_validate_json(json.dumps(published["settings"]["cell"]))
    seeds, success_radius = published["seeds"], published["settings"]["radius"]
    print(f"{cell.name}, seeds {seeds}, on {machine()['cpu']} with the kernels of {processor.core_type()}", flush=True)
    with (
        tempfile.TemporaryDirectory() as folder,  # nothing that an earlier training left may be taken over
        training_job.trained_block(
            cell, seeds, success_radius=success_radius, folder=Path(folder) / "block", report=print
        ) as (state, _),
    ):
        found = weights_checksum(state.policy().weights())
    if found == published["weights"]:
        print(f"equal: the weights have the published checksum, {found}")
        return 0
    print(f"not equal: the weights have the checksum {found}, published is {published['weights']}")
    here = versions()
    for name in DECISIVE:
        if here[name] != published["versions"][name]:
            print(f"{name} is {here[name]} here and was {published['versions'][name]} there: bits hold per version")
    if processor.kernels() != "portable":
        print("this processor has no AVX2, so its kernels round otherwise")
    return 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (ArtifactError, OSError) as error:
        sys.exit(f"{error}")
