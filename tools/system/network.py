# SPDX-License-Identifier: Apache-2.0
"""The board's network: DHCP, TFTP, the way to the rig, and the way from this machine to the daemon.

With a tap, all of it is in a network namespace without a way out, as a bench has a cable from the
PC to the board: dnsmasq is the server, and tools/board is in the namespace, too. Sockets that were
opened before, and Unix sockets, lead out of it. Otherwise QEMU's user network has the same addresses.
"""
import ctypes
import dataclasses
import fcntl
import os
import shutil
import socket
import subprocess

from children import LIBC
from problem import Problem
from relay import connect, relay

# Addresses reserved for documentation: no network that the PC is in has them.
HOST, BOARD, MASK_BITS = "192.0.2.1", "192.0.2.2", 24
NET = "192.0.2.0"
MAC = "52:54:00:76:67:01"
DAEMON_PORT = 7878
TUNGETFEATURES = 0x800454CF
CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000


@dataclasses.dataclass
class Network:
    netdev: str      # for QEMU
    rig: str         # the rig's address as the board sees it
    port: int        # of this machine, leads to the daemon
    report: list     # lines for the user


def listen(port, host="127.0.0.1"):
    """A listening socket; port 0 is any free one."""
    try:
        return socket.create_server((host, port))
    except OSError as error:
        raise Problem(f"port {port}: {error.strerror.lower()}") from error


def choose(mode, image, port, rig, running, folder):
    """Sets the network up. `port` is a socket that listens on this machine for clients of the
    daemon."""
    why = None
    if mode != "user":
        why = tap_fault() or enter_namespace()
        if why is None:
            make_tap()
            return with_tap(image, port, rig, running, folder)
        if mode == "tap":
            raise Problem(f"{why}; --network user does without")
    return with_user_network(image, port, rig, why)


def tap_fault():
    """Why this process cannot have a tap; None if it can, as far as that is known in advance."""
    try:
        with open("/dev/net/tun", "r+b", buffering=0) as device:
            fcntl.ioctl(device, TUNGETFEATURES, bytes(4))
    except OSError as error:
        return f"no tap: /dev/net/tun: {error.strerror.lower()}"
    return None


def enter_namespace():
    """Moves this process, which has one thread, to a new network namespace; why not, or None."""
    user, group = os.getuid(), os.getgid()
    if LIBC.unshare(CLONE_NEWNET if user == 0 else CLONE_NEWUSER | CLONE_NEWNET) != 0:
        return f"no network namespace: {os.strerror(ctypes.get_errno()).lower()}"
    if user != 0:
        for name, text in (("setgroups", "deny"), ("uid_map", f"0 {user} 1"),
                           ("gid_map", f"0 {group} 1")):
            with open(f"/proc/self/{name}", "w", encoding="ascii") as file:
                file.write(text)
    return None


def make_tap():
    for words in ("link set lo up", "tuntap add tap0 mode tap", f"addr add {HOST}/{MASK_BITS} dev tap0",
                  "link set tap0 up"):
        done = subprocess.run(["ip", *words.split()], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise Problem(f"ip {words}: {done.stderr.strip()}; --network user does without a tap")


def with_tap(image, port, rig, running, folder):
    if not shutil.which("dnsmasq"):
        raise Problem("dnsmasq is not in PATH: tools/install_packages board")
    log = folder / "dnsmasq.log"
    # --no-daemon: it stays the user that it is, as there may be no other in the namespace. No ping
    # before an address is given: it would take three seconds.
    running.start(["dnsmasq", "--no-daemon", "--conf-file=/dev/null", "--port=0", "--interface=tap0",
                   "--bind-interfaces", "--no-ping",
                   f"--dhcp-range={BOARD},{BOARD},1h", "--leasefile-ro", "--dhcp-authoritative",
                   "--dhcp-option=3", "--dhcp-option=6", "--enable-tftp", f"--tftp-root={image}",
                   "--dhcp-boot=boot.scr"], log)
    running.wait(lambda: b"TFTP root is" in log.read_bytes(), "dnsmasq")
    rig_port = listen(0, HOST)
    relay(rig_port, lambda: connect(rig), only_one=True)
    relay(port, lambda: socket.create_connection((BOARD, DAEMON_PORT), timeout=10))
    return Network("tap,ifname=tap0,script=no,downscript=no",
                   f"tcp:{HOST}:{rig_port.getsockname()[1]}", port.getsockname()[1],
                   [f"network: dnsmasq in a namespace, the board is {BOARD}"])


def with_user_network(image, port, rig, why):
    number = port.getsockname()[1]
    port.close()  # QEMU opens it
    rig_port = listen(0)
    relay(rig_port, lambda: connect(rig), only_one=True)
    report = "network: QEMU's own DHCP and TFTP" + (f" ({why})" if why else "")
    return Network(f"user,net={NET}/{MASK_BITS},host={HOST},dhcpstart={BOARD},tftp={image},"
                   f"bootfile=boot.scr,hostfwd=tcp:127.0.0.1:{number}-{BOARD}:{DAEMON_PORT}",
                   f"tcp:{HOST}:{rig_port.getsockname()[1]}", number, [report])
