# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The library installed by pip into an empty environment, without ROS; needs the network and minutes."""

import json
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
import pytest

from bag_writing import messages_of, write
from campaigns import made_campaign, result_columns, retained_series
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

COMPARES_WITH_SCIKIT_RF = """
import numpy as np
from satform.communication.line_matching import Line
from skrf.frequency import Frequency
from skrf.media import DefinedGammaZ0

frequency, light = 2.2e9, 299792458.0
media = DefinedGammaZ0(
    Frequency(frequency, frequency, 1, unit="hz"), z0=50.0, gamma=1j * 2.0 * np.pi * frequency / light
)
wavelength = light / frequency
stubs = 0
for load in (25.0 - 40.0j, 60.0 - 80.0j, 3.0 + 120.0j, 400.0 + 1.0j, 50.0 + 10.0j):
    line = Line(load, 50.0, 0.18 / wavelength)
    end = media.load((load - 50.0) / (load + 50.0))
    entry = media.line(0.18, "m") ** end
    assert abs(entry.s[0, 0, 0] - line.reflection_at(line.length)) < 1e-12
    assert abs(entry.z[0, 0, 0] / line.input_impedance - 1.0) < 1e-11
    assert abs(entry.s_vswr[0, 0, 0] / line.standing_wave_ratio - 1.0) < 1e-11
    assert abs(entry.s_db[0, 0, 0] + line.return_loss) < 1e-10
    for stub in line.stubs():
        feed = media.line(stub.position * wavelength, "m") ** end
        for matched in (
            media.shunt_delay_short(stub.short * wavelength, "m") ** feed,
            media.shunt_delay_open(stub.open * wavelength, "m") ** feed,
        ):
            assert abs(matched.s[0, 0, 0]) < 1e-10, (load, matched.s)
            stubs += 1
print(stubs)
"""


def lines_of_pandas(folder):
    """The lines of the documentation that read the results of a campaign, and a print of what they give."""
    text = (ROOT / "docs" / "campaigns.md").read_text(encoding="utf-8")
    (block,) = (found for found in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "pandas" in found)
    *first, reasons, percentiles, errors = block.replace("DIR/", f"{folder}/").strip().splitlines()
    return "\n".join(
        [
            *first,
            "import json",
            f"reasons, percentiles, errors = {reasons}, {percentiles}, {errors}",
            "percentiles = percentiles['figure.residual']",
            "print(json.dumps([list(reasons.to_dict().items()), percentiles.tolist(), errors.tolist()]))",
        ]
    )


@pytest.mark.setup_from_scratch
def test_the_library_is_installed_without_ros_flies_reads_a_bag_gives_tables_and_pandas_reads_campaigns(
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
    # After the above, which has to do without pyarrow. The network algebra of scikit-rf is independent of the
    # closed forms of the library. What the library is compared with may come by the faster installer.
    uv = Path(sys.prefix) / "bin" / "uv"
    others = ("pyarrow", "scikit-rf==2.2.0")
    installed = run(uv, "pip", "install", "--quiet", "--python", python, *others)
    assert installed.returncode == 0, installed.stderr
    compared = run(python, "-c", COMPARES_WITH_SCIKIT_RF)
    assert compared.returncode == 0, compared.stderr
    assert compared.stdout.split() == ["20"]
    folder = made_campaign(tmp_path / "campaign", 300)
    read = run(python, "-c", lines_of_pandas(folder.path))
    assert read.returncode == 0, read.stderr
    reasons, percentiles, errors = json.loads(read.stdout)
    columns = result_columns(folder)
    failed = ~columns["success"]
    assert 3 < failed.sum() < 300
    numbers, texts = (columns[name][failed].tolist() for name in ("number", "reason"))
    assert reasons == [list(entry) for entry in zip(numbers, texts, strict=True)]
    values = columns["figure.residual"]
    expected = np.percentile(values[np.isfinite(values)], (5, 50, 95))
    assert percentiles == pytest.approx(expected.tolist())
    assert errors == retained_series(folder, "tracking_error", 3)[17].tolist()
