# SPDX-License-Identifier: Apache-2.0
"""The router between independent models of a master and two sensors at 0x5D (cocotbext-i2c)."""
import logging
import os
import random

import cocotb
from cocotb.triggers import FallingEdge, First, RisingEdge, Timer
from cocotbext.i2c import I2cMaster, I2cMemory

LEFT, BOTH, RIGHT = 0x5C, 0x5D, 0x5E
OTHERS = (0x2C, 0x5F, 0x50, 0x5B, 0x1D, 0x00, 0x58, 0x7F)
RATES = (100e3, 400e3)
TRANSFERS = int(os.environ.get("TRANSFERS", "60"))
EVERY = int(os.environ.get("EVERY", "1"))          # of the bits at which something is interrupted
SEED = int(os.environ.get("SEED", "0")) or random.SystemRandom().randrange(1, 1 << 32)


class Sensor(I2cMemory):
    """The package's memory, but it recognises START and STOP anywhere: the package's own loop
    misses them after the last bit of an address, in an acknowledge, and in data it sends.
    """

    async def _until_low(self):
        """Waits until SCL is low; returns what came before."""
        while int(self.scl.value):
            await First(FallingEdge(self.scl), RisingEdge(self.sda), FallingEdge(self.sda))
            if int(self.scl.value):
                return "stop" if int(self.sda.value) else "start"
        return None

    async def _send_bit(self, b):
        ended = await self._until_low()
        if not ended:
            self._set_sda(bool(b))
            await RisingEdge(self.scl)
            ended = await self._until_low()
        self._set_sda(1)
        return ended

    async def _run(self):
        while True:
            self._set_sda(1)
            await FallingEdge(self.sda)
            ended = "start" if int(self.scl.value) else "stop"
            while ended == "start":
                self.handle_start()
                ended = await self._transfer()

    async def _transfer(self):
        """Handles a transfer from the address on; returns what ended it."""
        byte = await self._recv_byte()
        if isinstance(byte, str):
            return byte
        ended = await self._until_low()
        if ended or byte >> 1 != self.addr:
            return ended
        ended = await self._send_bit(0)
        while byte & 1 and not ended:
            data = await self.handle_read()
            for place in range(8):
                ended = ended or await self._send_bit(data >> (7 - place) & 1)
            if not ended and await self._recv_bit():
                return await self._recv_byte()
        while not ended:
            data = await self._recv_byte()
            if isinstance(data, str):
                return data
            ended = await self._send_bit(0)
            if not ended:                          # acknowledged to the end
                await self.handle_write(data)
        return ended


class Bus:
    """A master, two sensors, and the expected contents of their registers."""

    def __init__(self, dut, rate):
        self.dut = dut
        # The package's clock is half of its `speed`.
        self.master = I2cMaster(sda=dut.sda, sda_o=dut.master_sda, scl=dut.scl,
                                scl_o=dut.master_scl, speed=2 * rate)
        self.sensors = [
            Sensor(sda=dut.left_sda_line, sda_o=dut.left_sda, scl=dut.left_scl_line,
                   scl_o=dut.left_scl, addr=0x5D, size=256),
            Sensor(sda=dut.right_sda_line, sda_o=dut.right_sda, scl=dut.right_scl_line,
                   scl_o=dut.right_scl, addr=0x5D, size=256)]
        for part in (self.master, *self.sensors):
            part.log.setLevel(logging.WARNING)
        self.random = random.Random(SEED)
        self.expected = [bytearray(self.random.randbytes(256)) for _ in range(2)]
        for sensor, content in zip(self.sensors, self.expected):
            sensor.write_mem(0, bytes(content))

    @staticmethod
    def meant(address):
        return {LEFT: [0], RIGHT: [1], BOTH: [0, 1]}.get(address, [])

    async def send(self, data):
        """Sends bytes after a START; returns how many were acknowledged."""
        await self.master.send_start()
        for number, byte in enumerate(data):
            if await self.master.send_byte(byte):
                return number
        return len(data)

    async def write(self, address, index, data):
        sent = await self.send([address << 1, index, *data])
        await self.master.send_stop()
        for k in self.meant(address):
            for offset, byte in enumerate(data):
                self.expected[k][(index + offset) % 256] = byte
        assert sent == (2 + len(data) if self.meant(address) else 0), (hex(address), sent)

    async def read(self, address, index, count, stop_between):
        assert await self.send([address << 1, index]) == 2
        if stop_between:
            await self.master.send_stop()
        data = await self.master.read(address, count)
        await self.master.send_stop()
        k = self.meant(address)[0]
        wanted = bytes(self.expected[k][(index + i) % 256] for i in range(count))
        assert data == wanted, (hex(address), index, data.hex(), wanted.hex())

    def check(self):
        for k, sensor in enumerate(self.sensors):
            assert sensor.read_mem(0, 256) == bytes(self.expected[k]), f"sensor {k}"
        assert int(self.dut.timing_faults.value) == 0

    async def some_traffic(self):
        """Checks normal operation: one word to each sensor, read back."""
        for address in (LEFT, RIGHT, BOTH):
            await self.write(address, self.random.randrange(256), self.random.randbytes(2))
            await self.read(address, self.random.randrange(256), 2, False)
        self.check()


async def start(dut, rate):
    dut._log.info(f"seed {SEED}")
    dut.idle_ticks.value = 0
    dut.hold_sda.value = 0
    dut.hold_scl.value = 0
    dut.bypass.value = 0
    dut.clear.value = 0
    dut.rst.value = 1
    bus = Bus(dut, rate)
    await Timer(400, "ns")
    dut.rst.value = 0
    await Timer(120, "us")                         # the branches are freed first
    return bus


async def random_transfers(dut, rate):
    bus = await start(dut, rate)
    pick = bus.random
    for _ in range(TRANSFERS):
        address = pick.choice((LEFT, RIGHT, BOTH, pick.choice(OTHERS)))
        kind = pick.choice("wwrs")
        if kind == "w" or address in OTHERS:
            await bus.write(address, pick.randrange(256), pick.randbytes(pick.randrange(1, 5)))
        else:
            await bus.read(address, pick.randrange(256), pick.randrange(1, 5), kind == "s")
    bus.check()
    assert int(dut.stretches.value) == 0


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def transfers_at_100_khz(dut):
    await random_transfers(dut, 100e3)


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def transfers_at_400_khz(dut):
    await random_transfers(dut, 400e3)


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def other_addresses_give_no_clocks(dut):
    """After a foreign address, each branch has seen at most nine clocks."""
    bus = await start(dut, 400e3)
    for address in (*OTHERS, LEFT, RIGHT):
        before = [int(dut.left_rises.value), int(dut.right_rises.value)]
        await bus.write(address, 3, b"\x12\x34\x56")
        for k, rises in enumerate((dut.left_rises, dut.right_rises)):
            if k not in bus.meant(address):
                assert int(rises.value) - before[k] <= 9, hex(address)
    bus.check()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def broadcast_needs_both(dut):
    """A sensor that does not respond to its address: broadcast writes are not acknowledged."""
    bus = await start(dut, 400e3)
    for absent in (0, 1):
        errors = int(dut.errors.value)
        bus.sensors[absent].addr = 0x22
        assert await bus.send([BOTH << 1]) == 0
        await bus.master.send_stop()
        assert await bus.send([(RIGHT if absent else LEFT) << 1]) == 0
        await bus.master.send_stop()
        assert int(dut.errors.value) == errors + 2
        bus.sensors[absent].addr = 0x5D
        await bus.some_traffic()
    # The left sensor alone answers reads.
    bus.sensors[1].addr = 0x22
    assert await bus.send([BOTH << 1 | 1]) == 1
    bus.sensors[1].addr = 0x5D


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def abort_at_every_bit(dut):
    """STOP or START after any number of bits of a write or of a read's address: the next transfers
    work, and only complete bytes change a word.
    """
    bus = await start(dut, 400e3)
    pick = bus.random
    for address in (LEFT, RIGHT, BOTH):
        for bits in range(1 + bus.random.randrange(EVERY), 27, EVERY):
            for stop in (True, False):
                if bits % 9 == 8:
                    continue                       # the sensor acknowledges: no STOP can be made
                index, data = pick.randrange(255), pick.randbytes(1)[0]
                await bus.master.send_start()
                for bit in range(bits):
                    byte = (address << 1, index, data)[bit // 9]
                    if bit % 9 == 8:
                        await bus.master.recv_bit()
                    else:
                        await bus.master.send_bit(byte >> (7 - bit % 9) & 1)
                if bits >= 26:
                    for k in bus.meant(address):
                        bus.expected[k][index] = data
                if stop:
                    await bus.master.send_stop()
                await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def held_sda(dut):
    """A sensor that holds SDA: not acknowledged, and the other one is not disturbed."""
    bus = await start(dut, 400e3)
    for stuck, own, other in ((0, LEFT, RIGHT), (1, RIGHT, LEFT)):
        dut.hold_sda.value = 1 << stuck
        await Timer(2, "us")
        for address in (own, BOTH):
            assert await bus.send([address << 1, 0, 1]) == 0, (stuck, hex(address))
            await bus.master.send_stop()
        await bus.write(other, 7, b"\x01\x02")
        await bus.read(other, 7, 2, True)
        dut.hold_sda.value = 0
        await Timer(2, "us")
        await bus.some_traffic()


async def break_off_a_read(bus, k, zeros):
    """A sensor that sends zeros when the master abandons the transfer: it holds SDA."""
    address = RIGHT if k else LEFT
    bus.expected[k][16] = 0xFF >> zeros
    bus.sensors[k].write_mem(16, bytes([0xFF >> zeros]))
    assert await bus.send([address << 1, 16]) == 2
    assert await bus.send([address << 1 | 1]) == 1
    bus.master.bus_active = False


async def cleared(bus, k):
    """One bus clear of branch k, requested just before; the other branch works meanwhile."""
    dut = bus.dut
    rises = (dut.left_rises, dut.right_rises)[k]
    before = int(rises.value)
    await Timer(200, "ns")
    assert int(dut.clearing.value) >> k & 1
    if int(dut.clearing.value) != 3:
        await bus.write(LEFT if k else RIGHT, 9, bus.random.randbytes(1))
    await Timer(120, "us")
    assert int(dut.clearing.value) == 0
    assert int(rises.value) - before == 10
    assert int((dut.left_sda_line, dut.right_sda_line)[k].value) == 1
    dut.timing_faults.value = 0                    # timing is not defined during a reset
    await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def bus_clear(dut):
    """Reset frees sensors that hold SDA; so does the command: nine clocks and STOP."""
    bus = await start(dut, 400e3)
    for k in (0, 1):
        for zeros in range(1 + bus.random.randrange(EVERY), 9, EVERY):
            await break_off_a_read(bus, k, zeros)
            dut.rst.value = 1
            await Timer(1, "us")
            dut.master_sda.value = 1
            dut.master_scl.value = 1
            await Timer(1, "us")
            assert int((dut.left_sda_line, dut.right_sda_line)[k].value) == 0
            dut.rst.value = 0
            await cleared(bus, k)
        await FallingEdge(dut.clk)
        dut.clear.value = 1 << k
        await FallingEdge(dut.clk)
        dut.clear.value = 0
        await cleared(bus, k)


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def bus_clear_writes_nothing(dut):
    """A write interrupted anywhere, then reset: no clock of the bus clear completes a byte."""
    bus = await start(dut, 400e3)
    for bits in range(18, 27):
        index = bus.random.randrange(256)
        await bus.master.send_start()
        for bit in range(bits):
            byte = (BOTH << 1, index, ~bus.expected[0][index] & 0xFF)[bit // 9]
            if bit % 9 == 8:
                await bus.master.recv_bit()
            else:
                await bus.master.send_bit(byte >> (7 - bit % 9) & 1)
        dut.rst.value = 1
        await Timer(1, "us")
        dut.master_sda.value = 1
        dut.master_scl.value = 1
        bus.master.bus_active = False
        await Timer(1, "us")
        dut.rst.value = 0
        await Timer(120, "us")
        if bits == 26:                             # it was complete, and is being acknowledged
            for k in (0, 1):
                bus.expected[k][index] = bus.sensors[k].read_mem(index, 1)[0]
        dut.timing_faults.value = 0
        bus.check()
        await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def reset_anywhere(dut):
    """Reset after any number of bits; the master continues, ends with STOP, and everything works
    again.
    """
    bus = await start(dut, 400e3)
    for address in (LEFT, BOTH):
        for bits in range(bus.random.randrange(EVERY), 27, EVERY):
            await bus.master.send_start()
            for bit in range(bits):
                await bus.master.send_bit(((address << 1, 0x30, 0x99)[bit // 9] << 1 | 1)
                                          >> (8 - bit % 9) & 1)
            dut.rst.value = 1
            await Timer(bus.random.randrange(100, 900), "ns")
            dut.rst.value = 0
            for _ in range(9):
                await bus.master.send_bit(1)
            await bus.master.send_stop()
            await Timer(120, "us")
            for k in (0, 1):                       # a complete byte may have been stored
                bus.expected[k][:] = bus.sensors[k].read_mem(0, 256)
            dut.timing_faults.value = 0
            await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def silence_releases_all(dut):
    """The master stops anywhere: within 32 ms all lines are released, and the next START works."""
    bus = await start(dut, 400e3)
    for scl_high in (0, 1):
        for bits in (3, 6, 7, 8, 9, 13, 18):
            await bus.master.send_start()
            for bit in range(bits):
                await bus.master.send_bit((0xB800 >> (15 - bit)) & 1 if bit < 16 else 1)
            dut.master_sda.value = 1
            await Timer(700, "ns")
            dut.master_scl.value = scl_high
            timeouts = int(dut.timeouts.value)
            dut.idle_ticks.value = 1
            await Timer(34, "us")                  # as many milliseconds
            dut.idle_ticks.value = 0
            assert int(dut.timeouts.value) == timeouts + 1, bits
            await Timer(120, "us")
            assert int(dut.scl_low.value) == 0 and int(dut.sda_low.value) == 0
            assert int(dut.answer_low.value) == 0
            dut.master_scl.value = 1
            await Timer(2, "us")
            bus.master.bus_active = False
            await bus.send([0x10 << 1])
            await bus.master.send_stop()
            dut.timing_faults.value = 0
            await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def bypass(dut):
    """For bring-up: one branch under its own address, without translation."""
    bus = await start(dut, 100e3)
    for k in (0, 1):
        dut.bypass.value = 1 << k
        await Timer(1, "us")
        assert await bus.send([0x5D << 1, 4, 0x77]) == 3
        await bus.master.send_stop()
        for sensor in (0, 1):                      # the other one still responds to 0x5D
            bus.expected[sensor][4] = 0x77
        bus.check()
        dut.bypass.value = 0
        await Timer(1, "us")
        await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def stretching_is_counted(dut):
    bus = await start(dut, 100e3)
    dut.hold_scl.value = 2
    await Timer(2, "us")
    before = int(dut.stretches.value)
    await bus.write(LEFT, 1, b"\x05")
    assert int(dut.stretches.value) - before >= 9
    dut.hold_scl.value = 0
    await Timer(2, "us")
    await bus.some_traffic()


@cocotb.test(timeout_time=1, timeout_unit="sec")
async def disabled(dut):
    bus = await start(dut, 100e3)
    dut.enable.value = 0
    await Timer(1, "us")
    before = int(dut.left_rises.value)
    assert await bus.send([LEFT << 1]) == 0
    await bus.master.send_stop()
    assert int(dut.left_rises.value) == before
    dut.enable.value = 1
    await Timer(1, "us")
    await bus.some_traffic()
