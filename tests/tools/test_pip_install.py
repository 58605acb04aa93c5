# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The library installed by pip into an empty environment, without ROS; needs the network and minutes."""

import json
import shutil
import subprocess
import venv
from pathlib import Path

import pytest

from bag_writing import messages_of, write
from flights import SCENARIOS, shortened
from satform.flight.simulate import simulate

ROOT = Path(__file__).resolve().parents[2]
USES_THE_LIBRARY = """
import importlib.util, json, sys
import numpy as np
import satform as sf

scenario = sf.load_scenario(sys.argv[1]).with_({"timing.duration": 20.0}, expect=[])
record = sf.simulate(scenario)
bag = sf.read_bag(sys.argv[2])
dataset, frame = record.to_xarray(), record.to_pandas()
axes = sf.plot.tracking_error(record)
np.testing.assert_array_equal(dataset.position.sel(satellite="sat2").values, record["sat2"].position)
np.testing.assert_array_equal(frame.xs("sat2", level="satellite").position_y, record["sat2"].position[:, 1])
print(json.dumps({
    "from": sf.__file__,
    "differences": record.differences(bag.record),
    "scenarios": [scenario.digest(), bag.scenario.digest()],
    "complete": bag.complete,
    "lines": len(axes.lines),
    "dimensions": {name: size for name, size in dataset.sizes.items()},
    "units": [dataset.acceleration.attrs["units"], frame.attrs["units"]["acceleration_x"]],
    "undecided": [int(np.isnan(dataset.acceleration).sum()), int(frame.acceleration_x.isna().sum())],
    "rows": len(frame),
    "ros": [name for name in ("rclpy", "satform_msgs", "satform_nodes") if importlib.util.find_spec(name)],
}))
"""


@pytest.mark.setup_from_scratch
def test_the_library_is_installed_without_ros_and_flies_reads_a_bag_and_gives_tables(
    tmp_path, bare_environment
):
    scenario = shortened("triangle", 20.0)
    record = simulate(scenario)
    write(tmp_path / "bag", scenario, messages_of(record))
    source = tmp_path / "source"
    # A copy: setuptools builds in the folder that it installs from.
    shutil.copytree(ROOT / "ros_ws" / "src" / "satform", source)
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"

    def run(*command):
        return subprocess.run(
            command,
            env={**bare_environment, "MPLBACKEND": "Agg"},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            # Against a hang only: a machine that is busy with other work takes many times as long.
            timeout=3600,
            check=False,
        )

    # Of the hundreds of modules that come with it, Python compiles those that are used.
    installed = run(python, "-m", "pip", "install", "--quiet", "--no-compile", f"{source}[all]")
    assert installed.returncode == 0, installed.stderr
    used = run(python, "-c", USES_THE_LIBRARY, SCENARIOS / "triangle.yaml", tmp_path / "bag")
    assert used.returncode == 0, used.stderr
    found = json.loads(used.stdout)
    assert found["from"].startswith(str(tmp_path / "venv"))
    assert found["ros"] == []
    assert found["scenarios"] == [scenario.digest()] * 2
    assert found["differences"] == []
    assert found["complete"]
    assert found["lines"] == 3
    assert found["dimensions"] == {"time": 41, "satellite": 3, "axis": 3}
    assert found["units"] == ["m/s²", "m/s²"]
    assert found["undecided"] == [9, 3]
    assert found["rows"] == 123
