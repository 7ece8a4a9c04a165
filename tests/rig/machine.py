"""The virtual machine of the rig as an object: start, ask, save, kill. Needs what build-guest made."""

import io
import json
import os
import pathlib
import signal
import socket
import subprocess
import tarfile
import time

BOOT_PATIENCE_S = 300
# 64 bit with the instruction sets that Debian's libraries ask about; wider ones only cost emulation.
PROCESSOR = "Nehalem"


class MachineError(Exception):
    """The machine did not do what it was asked to; the text says what, and where its console output is."""


class Machine:
    """One QEMU process with two disks (root, data), a console and the agent's port.

    `folder` receives the overlays of the disks, the sockets and the console's text. With `state` the machine goes on
    from where `save` left it, else it boots.
    """

    def __init__(self, guest, folder, disks, state=None, memory_mb=1024, processors=2):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.disks = []
        for name, backing in zip(("disk", "data"), disks):
            overlay = self.folder / f"{name}.qcow2"
            overlay.unlink(missing_ok=True)
            run("qemu-img", "create", "-q", "-f", "qcow2", "-F", "qcow2", "-b", os.path.abspath(backing), overlay)
            self.disks.append(overlay)
        self._console = self.folder / "console.log"
        command = [
            # Does not outlive whoever started it, however that ends.
            "setpriv", "--pdeathsig", "KILL", "qemu-system-x86_64", "-accel", "tcg,thread=multi,tb-size=256", "-cpu", PROCESSOR, "-M", "q35",
            "-smp", str(processors), "-m", str(memory_mb), "-nodefaults", "-no-user-config", "-display", "none",
            "-no-reboot", "-kernel", kernel_of(guest), "-initrd", guest / "kernel/initrd",
            "-append", "console=ttyS0 quiet panic=-1 mitigations=off systemd.show_status=0 audit=0 root=/dev/vda rw",
            "-serial", f"file:{self._console}", "-device", "virtio-rng-pci", "-device", "virtio-serial-pci",
            "-chardev", f"socket,id=agent,path={self._path('agent')},server=on,wait=off",
            "-device", "virtserialport,chardev=agent,name=trigmesh.rig",
            "-qmp", f"unix:{self._path('qmp')},server=on,wait=off",
        ]
        for overlay in self.disks:
            command += ["-drive", f"file={overlay},format=qcow2,if=virtio,discard=unmap"]
        if state is not None:
            command += ["-incoming", "defer"]
        self._log = open(self.folder / "qemu.log", "wb")
        self._qemu = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=self._log,
                                      stderr=subprocess.STDOUT, start_new_session=True)
        try:
            self._qmp = self._connect("qmp")
            self._agent = self._connect("agent")
            self._qmp_file = self._qmp.makefile("rwb")
            self._qmp_file.readline()
            self.monitor("qmp_capabilities")
            self._unread = b""
            if state is None:
                self._read_answer(b"=ready\n", BOOT_PATIENCE_S)
            else:
                self.monitor("migrate-incoming", uri=f"exec:cat {state}")
                self._wait_until(lambda: self.monitor("query-status")["status"] == "paused", 60, "take up its state")
                self.monitor("cont")
        except BaseException:
            self.kill()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()

    def _path(self, name):
        return self.folder / f"{name}.sock"

    def _connect(self, name):
        connection = socket.socket(socket.AF_UNIX)
        directory = os.open(self.folder, os.O_PATH)
        try:
            self._wait_until(lambda: connection.connect_ex(f"/proc/self/fd/{directory}/{name}.sock") == 0, 20, "start")
        finally:
            os.close(directory)
        return connection

    def _wait_until(self, holds, patience_s, aim):
        end = time.monotonic() + patience_s
        while not holds():
            if self._qemu.poll() is not None or time.monotonic() > end:
                raise MachineError(f"the machine does not {aim}: see {self._console} and {self.folder}/qemu.log")
            time.sleep(0.05)

    def monitor(self, command, **arguments):
        """One command to QEMU itself; its result."""
        message = {"execute": command}
        if arguments:
            message["arguments"] = arguments
        self._qmp_file.write(json.dumps(message).encode() + b"\n")
        self._qmp_file.flush()
        while True:
            line = self._qmp_file.readline()
            if not line:
                raise MachineError(f"QEMU ended: see {self.folder}/qemu.log")
            answer = json.loads(line)
            if "error" in answer:
                raise MachineError(f"QEMU refuses {command}: {answer['error']['desc']}")
            if "return" in answer:
                return answer["return"]

    def _read_answer(self, end, patience_s, listener=None):
        """All that comes until `end` is met; the rest of its line is left for the caller."""
        deadline = time.monotonic() + patience_s
        while end not in self._unread:
            self._agent.settimeout(max(0.01, deadline - time.monotonic()))
            try:
                received = self._agent.recv(65536)
            except TimeoutError:
                received = b""
            if not received:
                raise MachineError(f"the machine does not answer (waited {patience_s:.0f} s): see {self._console}")
            if listener is not None:
                listener(received)
            self._unread += received
        text, self._unread = self._unread.split(end, 1)
        return text

    def begin(self, command, limit_s):
        """Starts a command in the guest without waiting for it; `finish` collects it."""
        self._agent.settimeout(20)
        self._agent.sendall(f"run {limit_s} {command}\n".encode())

    def finish(self, patience_s, listener=None):
        """Output and exit status of what `begin` started."""
        output = self._read_answer(b"\n=done ", patience_s, listener)
        status = int(self._read_answer(b"\n", 20))
        return output.decode(errors="replace"), status

    def listen(self, duration_s, listener):
        """Passes on what a command that was begun writes in that time; with 0, what it has written already."""
        end = time.monotonic() + duration_s
        while True:
            self._agent.settimeout(max(0.01, end - time.monotonic()))
            try:
                received = self._agent.recv(65536)
            except TimeoutError:
                received = b""
            if received:
                listener(received)
            elif time.monotonic() >= end:
                return

    def run(self, command, limit_s=120):
        """Runs a line of bash in /run/rig of the guest; its output and exit status (124: over the limit)."""
        self.begin(command, limit_s)
        return self.finish(limit_s + 60)

    def put(self, *paths):
        """Copies files and folders into /run/rig of the guest."""
        stream = io.BytesIO()
        with tarfile.open(fileobj=stream, mode="w", format=tarfile.GNU_FORMAT) as archive:
            for path in paths:
                archive.add(path, arcname=pathlib.Path(path).name, filter=anonymous)
        self._agent.settimeout(120)
        self._agent.sendall(b"put %d\n" % len(stream.getvalue()) + stream.getvalue())
        output, status = self.finish(120)
        if status != 0:
            raise MachineError(f"the guest cannot unpack what it was sent: {output}")

    def save(self, state):
        """Writes memory and devices to the file `state` and ends the machine; its disks then belong to that state."""
        self.monitor("stop")
        self.monitor("migrate-set-parameters", **{"max-bandwidth": 1 << 34})
        self.monitor("migrate", uri=f"exec:cat > {state}")
        self._wait_until(lambda: self._migrated(), 120, "save its state")
        self.monitor("quit")
        self._qemu.wait(20)

    def _migrated(self):
        status = self.monitor("query-migrate").get("status")
        if status == "failed":
            raise MachineError(f"QEMU cannot save the machine: see {self.folder}/qemu.log")
        return status == "completed"

    def freeze(self):
        """Stops the process between two instructions: its disk files are then as a power cut would leave them."""
        os.kill(self._qemu.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, self._qemu.pid, os.WSTOPPED | os.WNOWAIT)

    def thaw(self):
        os.kill(self._qemu.pid, signal.SIGCONT)

    def wait_for_end(self, patience_s):
        """Waits until the guest has switched itself off."""
        self._qemu.wait(patience_s)

    def kill(self):
        """The power cut: nothing that QEMU holds in its own memory reaches the disks."""
        if self._qemu.poll() is None:
            self._qemu.kill()
            self._qemu.wait()
        self._log.close()


def anonymous(entry):
    entry.uid = entry.gid = 0
    entry.uname = entry.gname = "root"
    return entry


def kernel_of(guest):
    return guest / "kernel/boot" / f"vmlinuz-{(guest / 'release').read_text().strip()}"


def run(*words):
    subprocess.run([str(word) for word in words], check=True)
