"""Where Snakemake's cache goes."""

import pytest

from reacher_shaping.jobs import cache_folder


@pytest.mark.parametrize("variable", ["HOME", "XDG_CACHE_HOME"])
def test_cache_is_the_persons_where_it_can_be_written(tmp_path, variable):
    environment = {variable: str(tmp_path / "home")}
    cache_folder.ensure(environment, tmp_path / "instead")
    assert environment == {variable: str(tmp_path / "home")}
    assert not (tmp_path / "instead").exists()


@pytest.mark.parametrize("variable", ["HOME", "XDG_CACHE_HOME"])
def test_cache_goes_into_the_study_where_the_persons_cannot_be_written(tmp_path, variable):
    environment = {variable: "/dev/null/home"}
    cache_folder.ensure(environment, tmp_path / "instead")
    assert environment["XDG_CACHE_HOME"] == str(tmp_path / "instead")
    assert (tmp_path / "instead").is_dir()
