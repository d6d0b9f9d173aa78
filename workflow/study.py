"""The project's folder and the settings of its study, for the commands beside Snakemake."""

from pathlib import Path

from reacher_shaping.settings.study import Study, load_study, read_settings

HERE = Path(__file__).resolve().parents[1]


def study(*overlays: Path) -> Study:
    """The study of config.yaml, with other files laid over it as `snakemake --configfile` does. Raises ConfigError."""
    return load_study(read_settings(HERE / "config.yaml", *overlays))
