"""The power is cut at twenty instants of capturing and model making: nothing that was acknowledged is lost."""

import os
import pathlib
import random
import re
import shutil
import subprocess
import time

from machine import MachineError, run

HERE = pathlib.Path(__file__).resolve().parent
SEED = 4
CUTS_OF_A_PHASE = 10
# Cuts of a phase after which the machine is booted again (a minute each); the others are put right on the host only.
BOOTS_OF_A_PHASE = int(os.environ.get("TRIGMESH_RIG_BOOTS", "1"))
# Longest time between two cuts, s: a capture takes a few seconds, a model some tens.
LONGEST_GAP_S = {"capturing": 1.5, "working": 7.0}
PATIENCE_S = 600


class Load:
    """What the machine tells while it captures sessions and makes their models."""

    def __init__(self):
        self._text = ""
        self.phase = "starting"
        self.acknowledged = {}

    def hear(self, received):
        *lines, self._text = (self._text + received.decode(errors="replace")).split("\n")
        for line in lines:
            if match := re.fullmatch(r"ack (\S+) (\d+)", line):
                self.acknowledged[match[1]] = int(match[2])
            elif match := re.fullmatch(r"phase (\S+)", line):
                self.phase = match[1]
            elif line.startswith(("FAILED", "=done")):
                raise MachineError(f"the machine does not capture: {line}")


def cut_at_random(rig, log):
    """Freezes the machine at random instants and keeps its disks as they are then: one folder a cut."""
    chance = random.Random(SEED)
    load = Load()
    left = {"capturing": CUTS_OF_A_PHASE, "working": CUTS_OF_A_PHASE}
    cuts = {phase: [] for phase in left}
    number = 0
    with rig.machine("06_power_cut.py") as machine:
        machine.put(HERE / "power_cut_load")
        machine.begin("bash ./power_cut_load", PATIENCE_S)
        end = time.monotonic() + PATIENCE_S
        while any(left.values()):
            if time.monotonic() > end:
                raise MachineError(f"the machine did not capture and work for long enough, cuts left: {left}")
            machine.listen(chance.uniform(0.1, LONGEST_GAP_S.get(load.phase, 1.0)), load.hear)
            if left.get(load.phase, 0) == 0:
                continue
            machine.freeze()
            machine.listen(0, load.hear)
            folder = rig.work / f"06_power_cut.py.cut{number:02}"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for disk in machine.disks:
                run("cp", "--reflink=auto", "--sparse=always", disk, folder / disk.name)
            machine.thaw()
            acknowledged = "".join(f"{session} {count}\n" for session, count in load.acknowledged.items())
            (folder / "acknowledged.txt").write_text(acknowledged)
            left[load.phase] -= 1
            cuts[load.phase].append(folder)
            number += 1
            log.append(f"{folder.name}: {load.phase}, acknowledged {dict(load.acknowledged)}")
    return cuts


def data_after(folder):
    """The files of the data disk as the next boot finds them, its file system's own journal replayed."""
    raw, files = folder / "data.raw", folder / "data"
    run("qemu-img", "convert", "-O", "raw", folder / "data.qcow2", raw)
    checked = subprocess.run(["e2fsck", "-p", raw], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if checked.returncode > 1:
        raise MachineError(f"the file system is beyond its own repair: {checked.stdout}")
    files.mkdir()
    subprocess.run(["debugfs", "-R", f"rdump / {files}", raw], stderr=subprocess.DEVNULL, check=True)
    raw.unlink()
    return files


def check(rig, folder, store, log, *options):
    command = [rig.programs / "rig_check_store", store, "--acknowledged", folder / "acknowledged.txt", *options]
    checked = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    log.append(f"{folder.name}: {'settled' if options else 'as it was cut'}\n{checked.stdout}")
    return checked.returncode == 0


def recover_on_host(rig, folder, store):
    """The same service on the host puts the sessions right, as it does at every start."""
    settings = folder / "trigmesh.toml"
    settings.write_text(f"[storage]\nroot = \"{store}\"\nreserve_mb = 10\n[trigger]\nbackend = \"none\"\n"
                        "[indicator]\nbackend = \"none\"\n[camera]\nbackend = \"replay\"\n"
                        f"device = \"{HERE.parents[2] / 'tools/demo/courtyard'}\"\n[reconstruction]\nenabled = false\n")
    command = [rig.programs / "trigmeshd", "--settings", settings, "--socket", folder / "control.sock"]
    with open(folder / "trigmeshd.log", "wb") as log:
        service = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log)
        try:
            end = time.monotonic() + 20
            while subprocess.run([rig.programs / "trigmesh", "status", "--socket", folder / "control.sock"],
                                 stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode != 0:
                if time.monotonic() > end or service.poll() is not None:
                    raise MachineError(f"the service does not start on what the cut left: see {folder}/trigmeshd.log")
                time.sleep(0.05)
        finally:
            service.terminate()
            status = service.wait(20)
    if status != 0:
        raise MachineError(f"the service ends with {status}: see {folder}/trigmeshd.log")


def scenario(rig):
    log = []
    cuts = cut_at_random(rig, log)
    success = True
    for folder in sum(cuts.values(), []):
        store = data_after(folder) / "sessions"
        if not store.is_dir():
            continue
        success &= check(rig, folder, store, log)
        recover_on_host(rig, folder, store)
        success &= check(rig, folder, store, log, "--settled")
    # Some of each phase for real: another boot, which ends with a model of each session that has enough frames.
    chance = random.Random(SEED)
    for folder in sum((chance.sample(folders, BOOTS_OF_A_PHASE) for folders in cuts.values()), []):
        with rig.reboot(f"{folder.name}.boot", [folder / "disk.qcow2", folder / "data.qcow2"]) as machine:
            machine.put(HERE / "power_cut_check", folder / "acknowledged.txt")
            output, status = machine.run("bash ./power_cut_check", PATIENCE_S)
        log.append(f"{folder.name}: booted again\n{output}")
        success &= status == 0
    if success:
        for folder in sum(cuts.values(), []):
            shutil.rmtree(folder)
    return "\n".join(log), success
