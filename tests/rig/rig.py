"""Runs scenarios of the test rig; started by tests/rig/run, which builds what this needs."""

import argparse
import concurrent.futures
import fcntl
import hashlib
import importlib.util
import pathlib
import shutil
import subprocess
import sys
import time
import traceback

from machine import Machine, MachineError, run

HERE = pathlib.Path(__file__).resolve().parent
# The longest a scenario may take; a hung one is a failed one.
SCENARIO_LIMIT_S = 400
PROGRAMS = ["conformance_camera", "conformance_trigger", "rig_check_store", "rig_colour_bars", "rig_uvc_camera", "rig_uvc_camera_test",
            "rig_vivid_camera", "rig_vivid_feeder"]


class Rig:
    """What all scenarios share: the machine with our package installed, saved when its service was up."""

    def __init__(self, build, package):
        self.guest = build / "rig"
        self.programs = build / "release/bin"
        self.package = package
        self.work = self.guest / "work"
        self.feed = self.guest / "feed"
        self._state = self.guest / "state"

    def prepare(self):
        """Boots the machine once and installs the package, unless that was done with the same files."""
        files = [self.package, self.guest / "disk/.key", HERE / "machine.py", HERE / "guest/install"]
        files += [self.programs / name for name in PROGRAMS + ["rig_make_feed"]]
        key = hashlib.sha256(b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)).hexdigest()
        if (self._state / ".key").is_file() and (self._state / ".key").read_text() == key:
            return
        begin = time.monotonic()
        shutil.rmtree(self._state, ignore_errors=True)
        shutil.rmtree(self.feed, ignore_errors=True)
        run(self.programs / "rig_make_feed", HERE.parents[1] / "tools/demo/courtyard/images", self.feed)
        disks = [self.guest / "disk/disk.qcow2", self.guest / "disk/data.qcow2"]
        with Machine(self.guest, self._state, disks) as machine:
            print(f"rig: booted in {time.monotonic() - begin:.0f} s", flush=True)
            programs = self._state / "programs"
            programs.mkdir()
            for name in PROGRAMS:
                run("strip", "-o", programs / name, self.programs / name)
            machine.put(programs, self.feed, self.package, HERE / "guest/install")
            output, status = machine.run(f"bash ./install ./{self.package.name}", 200)
            if status != 0:
                raise MachineError(f"the package cannot be installed:\n{output}")
            machine.save(self._state / "memory")
        (self._state / ".key").write_text(key)
        print(f"rig: package installed, machine saved in {time.monotonic() - begin:.0f} s", flush=True)

    def machine(self, name):
        """A machine that goes on from the saved one, with the helpers of scenarios."""
        machine = Machine(self.guest, self.work / name, [self._state / "disk.qcow2", self._state / "data.qcow2"],
                          state=self._state / "memory")
        machine.put(HERE / "scenarios/helpers.sh")
        return machine

    def reboot(self, name, disks):
        """Boots a machine on disks that another one left behind."""
        machine = Machine(self.guest, self.work / name, disks)
        machine.put(HERE / "scenarios/helpers.sh", self.feed, self._state / "programs")
        return machine


def run_in_guest(rig, path):
    with rig.machine(path.name) as machine:
        machine.put(path)
        output, status = machine.run(f"bash ./{path.name}", SCENARIO_LIMIT_S)
        if status != 0:
            journal, _ = machine.run("journalctl --no-pager --quiet --unit=trigmesh.service --lines=60 "
                                     "--output=short-monotonic; systemctl status --no-pager --full --lines=0 "
                                     "trigmesh.service; dmesg | tail -5")
            output += f"\n--- journal of the guest\n{journal}"
        if status == 124:
            output += f"\nthe scenario took more than {SCENARIO_LIMIT_S} s"
    return output, status == 0


def run_on_host(rig, path):
    spec = importlib.util.spec_from_file_location(f"scenario_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.scenario(rig)


def run_scenario(rig, path, keep):
    begin = time.monotonic()
    try:
        output, success = (run_on_host if path.suffix == ".py" else run_in_guest)(rig, path)
    except (MachineError, OSError, subprocess.SubprocessError) as error:
        output, success = f"{error}\n{traceback.format_exc()}", False
    folder = rig.work / path.name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "output.txt").write_text(output)
    print(f"{'ok    ' if success else 'FAILED'} {path.stem:<24} {time.monotonic() - begin:4.0f} s", flush=True)
    if not success:
        print(output, flush=True)
    elif not keep:
        for overlay in rig.work.glob(f"{path.name}*/*.qcow2"):
            overlay.unlink()
    return success


def select(wanted):
    paths = sorted(path for path in (HERE / "scenarios").iterdir() if path.name[0].isdigit())
    selected = [path for path in paths if not wanted or path.stem in wanted or path.stem.split("_")[0] in wanted]
    unknown = [name for name in wanted if not any(name in (path.stem, path.stem.split("_")[0]) for path in paths)]
    if unknown:
        sys.exit(f"run: there is no scenario {', '.join(unknown)}; see tests/rig/run --list")
    return selected


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--package", type=pathlib.Path, required=True)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--prepare", action="store_true")
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("scenarios", nargs="*")
    arguments = parser.parse_args()
    sys.path.insert(0, str(HERE))
    selected = select(arguments.scenarios)
    rig = Rig(arguments.build, arguments.package)
    with open(rig.guest / ".state.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        rig.prepare()
    if arguments.prepare:
        return 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        results = list(pool.map(lambda path: run_scenario(rig, path, arguments.keep), selected))
    print(f"rig: {sum(results)} of {len(results)} scenarios succeeded", flush=True)
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
