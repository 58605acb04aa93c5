# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the set-up decides before it changes anything."""

import importlib.util
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from satform_setup import machine, workspace
from satform_setup.command import ensure, finished
from satform_setup.errors import SetupError, pip_error_text
from satform_setup.installer import asks_for_pip, wanted_requirements
from satform_setup.layout import Layout, folder_digest, read_stamp, write_stamp
from satform_setup.logged_process import end_orphans
from satform_setup.ros_distribution import WHEELS, WHEELS_MARK, check_python_of_ros, find_ros
from satform_setup.ros_wheels_fix import fix_file_names
from satform_setup.variables import applied, base_variables, shell_variables
from satform_setup.virtual_environment import remove_venv, venv_fits, wanted_venv

ROOT = Path(__file__).resolve().parents[2]

# Printed by pip 23 and 24 in the situations named.
PIP_WITHOUT_NETWORK = """\
WARNING: Retrying (Retry(total=0, connect=None, read=None, redirect=None, status=None)) after connection \
broken by 'NewConnectionError('<pip._vendor.urllib3.connection.HTTPSConnection object at 0x7fc3>: Failed to \
establish a new connection: [Errno -3] Temporary failure in name resolution')': /simple/numpy/
ERROR: Could not find a version that satisfies the requirement numpy==2.4.6 (from versions: none)
ERROR: No matching distribution found for numpy==2.4.6
"""
PIP_WITHOUT_WHEEL = """\
ERROR: Could not find a version that satisfies the requirement numpy==2.4.6 (from versions: 1.26.3, 1.26.4)
ERROR: No matching distribution found for numpy==2.4.6
"""
PIP_ON_A_FULL_DISK = (
    "ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device\n"
)
PIP_WITH_A_FOREIGN_CERTIFICATE = """\
Could not fetch URL: There was a problem confirming the ssl certificate: Max retries exceeded with url: \
/simple/numpy/ (Caused by SSLError(SSLCertVerificationError(1, '[SSL: CERTIFICATE_VERIFY_FAILED] certificate \
verify failed: self-signed certificate in certificate chain (_ssl.c:1006)'))) - skipping
ERROR: No matching distribution found for numpy==2.4.6
"""


def make_package(sources, name, dependencies=""):
    folder = sources / name
    folder.mkdir(parents=True)
    text = f"<package><name>{name}</name>{dependencies}</package>"
    (folder / "package.xml").write_text(text, encoding="utf-8")
    return workspace.read_package(folder)


@pytest.mark.parametrize(
    ("output", "words"),
    [
        (PIP_WITHOUT_NETWORK, "connect this machine to the network"),
        (PIP_WITHOUT_WHEEL, "no numpy==2.4.6 for Python 3.12.3"),
        (PIP_ON_A_FULL_DISK, "the disk is full"),
        (PIP_WITH_A_FOREIGN_CERTIFICATE, "PIP_CERT"),
        ("something nobody has seen before", "pip failed;"),
    ],
)
def test_what_pip_prints_becomes_the_sentence_of_its_cause(output, words):
    assert words in pip_error_text(output, "3.12.3")


@pytest.mark.parametrize(
    ("system", "processor", "largest_index", "glibc", "words"),
    [
        ("Linux", "aarch64", 2**63 - 1, (2, 39), "Linux on aarch64"),
        ("Darwin", "x86_64", 2**63 - 1, (), "Darwin on x86_64"),
        ("Linux", "x86_64", 2**31 - 1, (2, 39), "32-bit Python"),
        ("Linux", "x86_64", 2**63 - 1, (2, 31), "has glibc 2.31"),
        ("Linux", "x86_64", 2**63 - 1, (), "another C library"),
    ],
)
def test_a_machine_without_wheels_of_ros_is_told_what_it_lacks(
    system, processor, largest_index, glibc, words
):
    with pytest.raises(SetupError, match=words):
        machine.check_platform(system, processor, largest_index, glibc)


@pytest.mark.parametrize("glibc", [(2, 35), (2, 36), (2, 39), (2, 41)])
def test_ubuntu_22_and_later_and_debian_12_and_later_have_wheels_of_ros(glibc):
    machine.check_platform("Linux", "x86_64", 2**63 - 1, glibc)


def test_a_machine_without_a_compiler_is_told_how_to_get_one(tmp_path):
    missing = machine.missing_packages({"PATH": str(tmp_path)})
    with pytest.raises(SetupError, match=r"a C\+\+ compiler.* missing; run: sudo apt install .*g\+\+"):
        machine.check_packages(missing)


def test_a_compiler_chosen_by_variable_is_looked_for_by_its_name(tmp_path):
    for name in ("chosen", "cc", "ccache"):
        (tmp_path / name).touch(mode=0o755)
    found = {"PATH": str(tmp_path)}
    assert "g++" not in machine.missing_packages({**found, "CXX": "chosen -O0"})
    assert "g++" not in machine.missing_packages({**found, "CXX": "ccache g++"})
    assert "g++" in machine.missing_packages({**found, "CXX": "absent"})


def test_a_python_without_venv_is_told_the_package_that_brings_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(SetupError, match=r"Python's venv.*sudo apt install python3(\.\d+)?-venv"):
        machine.check_packages(machine.missing_packages(os.environ))


def test_a_nearly_full_disk_is_refused_before_any_work():
    machine.check_space(3_000_000_000)
    with pytest.raises(SetupError, match=r"has 0\.5 GB free"):
        machine.check_space(500_000_000)


def test_a_folder_that_cannot_stand_in_a_search_path_is_refused(tmp_path):
    machine.check_folder(tmp_path, WHEELS)
    with pytest.raises(SetupError, match="':' in its path"):
        machine.check_folder(tmp_path / "a:b", WHEELS)


def test_a_folder_with_other_letters_than_ascii_is_refused_with_an_installed_ros_alone(tmp_path):
    folder = tmp_path / "Zürich"
    folder.mkdir()
    machine.check_folder(folder, WHEELS)
    with pytest.raises(
        SetupError, match="has 'ü' in its path, which the installed ROS cannot build messages in"
    ):
        machine.check_folder(folder, "/opt/ros/jazzy")
    machine.check_folder(tmp_path, "/opt/ros/jazzy")


def test_the_list_of_files_is_read_as_utf8_only_where_the_folder_needs_it(tmp_path):
    for name in ("plain", "Zürich"):
        path = tmp_path / name / ".venv" / "share/rosidl_adapter/cmake/rosidl_adapt_interfaces.cmake"
        path.parent.mkdir(parents=True)
        path.write_text('  file(STRINGS "${idl_output}" idl_tuples)\n')
        cached = tmp_path / f"{name} in the cache"
        cached.hardlink_to(path)
        fix_file_names(Layout(tmp_path / name))
        fix_file_names(Layout(tmp_path / name))
        assert path.read_text().count("ENCODING UTF-8") == (name == "Zürich")
        assert "ENCODING" not in cached.read_text()
    path.write_text("something else")
    with pytest.raises(SetupError, match="does not read its list of files by"):
        fix_file_names(Layout(tmp_path / "Zürich"))


def test_a_shell_without_ros_gets_the_wheels_and_a_sourced_jazzy_is_used():
    sourced = {"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/opt/ros/jazzy"}
    assert find_ros({"PATH": "/bin"}) == WHEELS
    assert find_ros(sourced) == "/opt/ros/jazzy"
    assert find_ros({**sourced, WHEELS_MARK: "1"}) == WHEELS


def test_another_distribution_than_jazzy_is_refused_by_name():
    with pytest.raises(SetupError, match="has sourced ROS 2 humble and satform needs Jazzy"):
        find_ros({"ROS_DISTRO": "humble", "AMENT_PREFIX_PATH": "/opt/ros/humble"})


def test_a_sourced_ros_of_another_python_is_refused(tmp_path):
    (tmp_path / "lib" / "python3.12" / "site-packages" / "rclpy").mkdir(parents=True)
    check_python_of_ros(str(tmp_path), (3, 12))
    with pytest.raises(SetupError, match=r"needs Python 3\.12, the first one on the PATH is 3\.11"):
        check_python_of_ros(str(tmp_path), (3, 11))


def test_every_requirement_is_pinned_to_one_version():
    lines = wanted_requirements((ROOT / "requirements.txt").read_text(encoding="utf-8"), WHEELS)
    pins = [line for line in lines if not line.startswith("--")]
    assert [
        pin for pin in pins if not re.fullmatch(r"[\w.-]+==[\w.]+( ; python_version < \"3\.14\")?", pin)
    ] == []
    names = [pin.partition("==")[0].lower().replace("_", "-") for pin in pins]
    assert sorted(names) == sorted(set(names))


def test_a_sourced_ros_leaves_out_ros_and_nothing_else():
    text = "# ROS\nros-rclpy==1\n\nrosbags==2  \n--only-binary :all:\n"
    assert wanted_requirements(text, "/opt/ros/jazzy") == ["rosbags==2", "--only-binary :all:"]
    assert wanted_requirements(text, WHEELS) == ["ros-rclpy==1", "rosbags==2", "--only-binary :all:"]


def test_a_mirror_or_proxy_that_only_pip_knows_makes_pip_install_everything():
    assert asks_for_pip("global.index-url='https://mirror.example/simple'")
    assert asks_for_pip(":env:.proxy='http://proxy.example:3128'")
    assert asks_for_pip("global.no-index='true'")
    assert not asks_for_pip("global.cert='/etc/ssl/ca.pem'\n:env:.default-timeout='60'\n")


def test_the_hash_of_a_folder_follows_names_and_contents_but_not_times_or_byproducts(tmp_path):
    (tmp_path / "a.py").write_text("1")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b.py").write_text("2")
    first = folder_digest(tmp_path)
    os.utime(tmp_path / "a.py", (0, 0))
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "a.pyc").write_text("3")
    assert folder_digest(tmp_path) == first
    (tmp_path / "a.py").write_text("12")
    changed = folder_digest(tmp_path)
    (tmp_path / "a.py").write_text("1")
    (tmp_path / "sub" / "b.py").rename(tmp_path / "sub" / "c.py")
    assert len({first, changed, folder_digest(tmp_path)}) == 3


def test_what_is_built_from_a_changed_package_is_built_again_and_what_only_runs_it_is_not(tmp_path):
    packages = [
        make_package(tmp_path, "messages"),
        make_package(tmp_path, "library", "<build_depend>messages</build_depend>"),
        make_package(tmp_path, "tool", "<depend>library</depend>"),
        make_package(tmp_path, "node", "<exec_depend>messages</exec_depend>"),
    ]
    assert workspace.packages_to_build(packages, {"messages"}) == {"messages", "library", "tool"}
    assert workspace.packages_to_build(packages, {"node"}) == {"node"}
    assert workspace.packages_to_build(packages, set()) == set()


def test_a_change_of_one_package_changes_the_hash_of_that_package_alone(tmp_path):
    for name in ("one", "two"):
        make_package(tmp_path, name)
    before = workspace.source_digests(tmp_path)
    (tmp_path / "two" / "new.py").touch()
    after = workspace.source_digests(tmp_path)
    assert before["one"] == after["one"]
    assert before["two"] != after["two"]


def test_what_the_wheels_lack_is_built_with_them_and_left_to_an_installed_ros():
    layout = Layout(ROOT)
    (package,) = workspace.missing_in_wheels(layout, WHEELS)
    assert workspace.read_package(package).name == "tf2_msgs"
    assert "wheels/tf2_msgs" in workspace.build_arguments(layout, WHEELS)
    assert workspace.missing_in_wheels(layout, "/opt/ros/jazzy") == []
    assert "wheels/tf2_msgs" not in workspace.build_arguments(layout, "/opt/ros/jazzy")
    # colcon by itself, in the workspace, passes them over.
    assert (package.parent / "COLCON_IGNORE").exists()


def test_a_package_description_that_is_not_xml_is_named(tmp_path):
    (tmp_path / "package.xml").write_text("<package>")
    with pytest.raises(SetupError, match=r"package\.xml is not XML"):
        workspace.read_package(tmp_path)


def test_removing_a_package_takes_all_of_its_files_and_none_of_its_namesakes(project):
    layout = Layout(project)
    modules = layout.install / "lib" / "python3.11" / "site-packages"
    ours = [
        layout.build / "sat" / "CMakeCache.txt",
        layout.install / "lib" / "libsat__rosidl_generator_c.so",
        layout.install / "lib" / "sat" / "node",
        layout.install / "share" / "ament_index" / "resource_index" / "packages" / "sat",
        modules / "sat" / "gone.py",
        modules / "sat-0.1.0-py3.11.egg-info" / "PKG-INFO",
    ]
    others = [layout.install / "lib" / "sat_nodes" / "node", modules / "sat_msgs" / "msg.py"]
    for path in ours + others:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    workspace.remove_package(layout, "sat")
    assert [path for path in ours if path.exists()] == []
    assert all(path.exists() for path in others)


def test_a_stamp_that_was_cut_off_counts_as_none(tmp_path):
    stamp = tmp_path / "complete.json"
    write_stamp(stamp, {"ROS": WHEELS})
    assert read_stamp(stamp) == {"ROS": WHEELS}
    assert list(tmp_path.iterdir()) == [stamp]
    stamp.write_bytes(stamp.read_bytes()[:-3])
    assert read_stamp(stamp) == {}


@pytest.fixture
def finished_venv(project):
    """A virtual environment that bears the stamp of a finished one."""
    layout = Layout(project)
    layout.python.parent.mkdir(parents=True)
    layout.python.touch(mode=0o755)
    layout.log.touch()
    write_stamp(layout.venv_stamp, wanted_venv(layout, WHEELS))
    return layout


def test_an_environment_without_its_stamp_is_not_a_finished_one(finished_venv):
    assert venv_fits(finished_venv, WHEELS)
    finished_venv.venv_stamp.unlink()
    assert not venv_fits(finished_venv, WHEELS)


def test_an_environment_whose_python_is_gone_is_made_again(finished_venv):
    finished_venv.python.unlink()
    finished_venv.python.symlink_to("/nowhere/python3")
    assert not venv_fits(finished_venv, WHEELS)


def test_an_environment_of_other_requirements_or_another_ros_is_made_again(finished_venv):
    assert not venv_fits(finished_venv, "/opt/ros/jazzy")
    with finished_venv.requirements.open("a", encoding="utf-8") as file:
        file.write("six==1.17.0\n")
    assert not venv_fits(finished_venv, WHEELS)


def test_a_moved_project_makes_its_environment_again(finished_venv):
    moved = finished_venv.root.rename(finished_venv.root.with_name("elsewhere"))
    assert not venv_fits(Layout(moved), WHEELS)


def test_a_finished_environment_without_a_finished_build_is_not_started(finished_venv):
    assert finished(finished_venv, WHEELS) is None


@pytest.mark.parametrize("runs", [True, False])
def test_another_users_environment_that_cannot_be_used_is_left_alone_and_the_reason_is_given(
    finished_venv, monkeypatch, runs
):
    may = {finished_venv.root: False, finished_venv.python: runs}
    monkeypatch.setattr(os, "access", lambda path, _mode: may[path])
    reason = "does not match the sources" if runs else "this user may not run its Python"
    with pytest.raises(SetupError, match=f"is another user's, and .*{reason}"):
        ensure(finished_venv, WHEELS, {}, clean=False)
    assert read_stamp(finished_venv.venv_stamp)


def test_a_virtual_environment_of_the_users_own_is_not_removed(project):
    layout = Layout(project)
    layout.venv.mkdir()
    (layout.venv / "pyvenv.cfg").touch()
    with pytest.raises(SetupError, match="was not made by satform"):
        remove_venv(layout)
    assert (layout.venv / "pyvenv.cfg").exists()


def test_a_folder_on_pythonpath_with_parts_for_scenarios_reaches_a_program_and_another_satform_does_not(
    project, tmp_path
):
    for folder, module in (("law", "my_law"), ("workspace", "satform"), ("other", "other")):
        (tmp_path / folder / f"{module}.egg-info").mkdir(parents=True)
        group = "console_scripts" if folder == "other" else "satform.controllers"
        (tmp_path / folder / f"{module}.egg-info" / "entry_points.txt").write_text(f"[{group}]\n")
    (tmp_path / "workspace" / "satform").mkdir()
    search = os.pathsep.join(str(tmp_path / name) for name in ("other", "workspace", "law", "none"))
    program = applied(
        base_variables(Layout(project), WHEELS), shell_variables(WHEELS, {"PYTHONPATH": search})
    )
    assert program["PYTHONPATH"] == str(tmp_path / "law")


def test_with_the_wheels_nothing_of_another_ros_or_python_reaches_a_program(project):
    layout = Layout(project)
    shell = {
        "PYTHONPATH": "/home/me/lib",
        "AMENT_PREFIX_PATH": "/opt/ros/rolling",
        "LD_LIBRARY_PATH": "/opt/conda/lib",
        "PATH": "/bin",
        "ROS_DOMAIN_ID": "7",
    }
    program = applied(base_variables(layout, WHEELS), shell_variables(WHEELS, shell))
    assert "/home/me/lib" not in program.get("PYTHONPATH", "")
    assert program["AMENT_PREFIX_PATH"] == str(layout.venv)
    assert "/opt/conda/lib" not in program["LD_LIBRARY_PATH"].split(":")
    assert program["PATH"] == f"{layout.venv / 'bin'}:/bin"
    assert program["ROS_DOMAIN_ID"] == "7"
    assert program[WHEELS_MARK] == "1"


def test_with_a_sourced_ros_its_folders_stay_behind_ours(project):
    shell = {
        "PYTHONPATH": "/opt/ros/jazzy/lib/python3.12/site-packages",
        "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp",
    }
    ros = "/opt/ros/jazzy"
    program = applied(base_variables(Layout(project), ros), shell_variables(ros, shell))
    assert program["PYTHONPATH"].endswith(shell["PYTHONPATH"])
    assert program["RMW_IMPLEMENTATION"] == "rmw_cyclonedds_cpp"
    assert WHEELS_MARK not in program


def test_a_number_of_threads_the_user_chose_is_kept(project):
    shell = {"OPENBLAS_NUM_THREADS": "4"}
    program = applied(base_variables(Layout(project), WHEELS), shell)
    assert program["OPENBLAS_NUM_THREADS"] == "4"
    assert program["OMP_NUM_THREADS"] == "1"


def test_what_a_killed_set_up_left_running_is_ended_with_its_children_and_nothing_else(project):
    child = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import time; time.sleep(60)'])"
    command = [sys.executable, "-I", "-c", child]
    orphan = subprocess.Popen(command, env={**os.environ, "SATFORM_SETUP_OF": str(project)})
    stranger = subprocess.Popen(
        command, env={**os.environ, "SATFORM_SETUP_OF": f"{project}-2"}, start_new_session=True
    )
    children = Path(f"/proc/{orphan.pid}/task/{orphan.pid}/children")
    try:
        deadline = time.monotonic() + 20
        while not (grandchildren := children.read_text().split()) and time.monotonic() < deadline:
            time.sleep(0.02)  # polls: no event for the start of another process's child
        end_orphans(Layout(project))
        assert orphan.wait(5) == -signal.SIGKILL
        assert [pid for pid in grandchildren if _runs(pid)] == []
        assert grandchildren
        assert stranger.poll() is None
    finally:
        os.killpg(stranger.pid, signal.SIGKILL)
        stranger.wait()


def _runs(pid):
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def test_a_python_that_is_on_the_path_but_does_not_run_is_passed_over(project, tmp_path):
    make_package(project / "ros_ws" / "src", "satform", "<version>1.2.3</version>")
    programs = _programs(tmp_path, "dirname", "readlink")
    (programs / "python3").write_text("#!/bin/sh\necho 'pyenv: python3: command not found' >&2\nexit 127\n")
    (programs / "python3").chmod(0o755)
    (programs / "python3.12").symlink_to(sys.executable)
    result = _launch(project, ["--version"], programs)
    assert (result.returncode, result.stdout, result.stderr) == (0, "satform 1.2.3\n", "")


def test_a_machine_without_a_fitting_python_is_told_which_ones_fit(project, tmp_path):
    launcher = project / "tools" / "satform"
    launcher.write_text(
        launcher.read_text(encoding="utf-8").replace(" /usr/bin/python3;", ";"), encoding="utf-8"
    )
    result = _launch(project, ["run", "triangle"], _programs(tmp_path, "dirname", "readlink"))
    assert result.returncode == 2
    assert re.fullmatch(r"satform: needs Python 3\.11 .*sudo apt install python3 .*\n", result.stderr)


def test_a_second_set_up_waits_for_the_first_and_then_goes_on(project, bare_environment):
    holder = """if True:
        import fcntl, sys
        file = open(sys.argv[1], "rb")
        fcntl.flock(file, fcntl.LOCK_EX)
        print("held", flush=True)
        sys.stdin.read()
    """
    launcher = project / "tools" / "satform"
    with subprocess.Popen(
        [sys.executable, "-I", "-c", holder, str(launcher)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as first:
        assert first.stdout.readline() == "held\n"
        # A compiler that is not there ends the second at its first own step.
        environment = {**bare_environment, "CXX": "absent"}
        with subprocess.Popen(
            [launcher, "setup"], env=environment, stderr=subprocess.PIPE, text=True
        ) as second:
            assert "waiting for it to finish" in second.stderr.readline()
            assert second.poll() is None
            first.stdin.close()
            assert "a C++ compiler" in second.stderr.readline()
            assert second.wait(20) == 2


def _programs(folder, *names):
    programs = folder / "programs"
    programs.mkdir()
    for name in names:
        found = next(path for path in (Path("/usr/bin") / name, Path("/bin") / name) if path.exists())
        (programs / name).symlink_to(found)
    return programs


def _launch(project, arguments, programs):
    command = ["/bin/sh", str(project / "tools" / "satform"), *arguments]
    return subprocess.run(command, env={"PATH": str(programs)}, capture_output=True, text=True, check=False)
