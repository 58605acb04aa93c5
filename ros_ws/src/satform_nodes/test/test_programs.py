"""The programs of the installed package are there."""

from importlib.metadata import distribution


def test_every_program_can_be_loaded() -> None:
    programs = {entry.name: entry.load() for entry in distribution("satform_nodes").entry_points}
    assert set(programs) >= {"plant_node", "satellite_node", "group_node", "recorder_node"}
    assert all(callable(program) for program in programs.values())
