"""The link to a served rig's pseudo-terminal."""

import os
import sys

import pytest

from pipelines.errors import DeviceError
from pipelines.rig.listening import _linked

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")


@pytest.fixture
def link(tmp_path):
    return tmp_path / "port"


def test_a_link_that_leads_nowhere_any_more_is_replaced_and_removed_at_the_end(link, tmp_path):
    link.symlink_to(tmp_path / "gone")
    with _linked(str(link), "/dev/null") as place:
        assert (place, os.readlink(link)) == (str(link), "/dev/null")
    assert not link.is_symlink()


def test_a_link_whose_port_is_another_processs_by_now_is_reported_as_a_possible_leftover(link):
    link.symlink_to("/dev/null")
    with pytest.raises(DeviceError) as refused, _linked(str(link), "/dev/zero"):
        raise AssertionError("the link is taken")
    assert (
        str(refused.value)
        == f"{link}: exists already, where a virtual rig's link was to be. End the rig that made"
        " it, remove it, or name another path in serial_port"
    )
    assert os.readlink(link) == "/dev/null"


def test_a_file_in_the_place_of_the_link_stays(link):
    link.write_text("a month of work")
    with (
        pytest.raises(DeviceError, match="exists already, where a virtual"),
        _linked(str(link), "/dev/null"),
    ):
        raise AssertionError("the place is taken")
    assert link.read_text() == "a month of work"
