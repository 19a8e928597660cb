# SPDX-License-Identifier: Apache-2.0
"""The register map's test vectors through an independent I2C master (cocotbext-i2c)."""
import json
import logging
import os

import cocotb
from cocotb.triggers import Timer
from cocotbext.i2c import I2cMaster

with open(os.environ["REGISTER_MAP"], encoding="ascii") as file:
    MAP = json.load(file)
EVERY = int(os.environ.get("EVERY", "1"))  # only every N-th vector
SHARD, SHARDS = (int(word) for word in os.environ.get("SHARD", "0/1").split("/"))
BLOCK = 32  # words read at once
KEY = 0x4C4B
UNLOCK = 0x0D


class Bus:
    """Sends words with the master; returns what was acknowledged."""

    def __init__(self, dut, khz):
        # The package's clock is half of its `speed`.
        self.master = I2cMaster(sda=dut.sda, sda_o=dut.master_sda, scl=dut.scl,
                                scl_o=dut.master_scl, speed=2 * khz * 1000)
        self.master.log.setLevel(logging.WARNING)

    async def write(self, data):
        """Returns the number of acknowledged bytes, including the address."""
        await self.master.send_start()
        acknowledged = 0
        for byte in [MAP["address"] << 1, *data]:
            if await self.master.send_byte(byte):
                break
            acknowledged += 1
        await self.master.send_stop()
        return acknowledged

    async def write_word(self, index, value):
        return await self.write([index, value >> 8, value & 0xFF])

    async def read(self, index, count=1):
        await self.master.send_start()
        assert not await self.master.send_byte(MAP["address"] << 1)
        assert not await self.master.send_byte(index)
        data = await self.master.read(MAP["address"], 2 * count)
        await self.master.send_stop()
        return [data[i] << 8 | data[i + 1] for i in range(0, 2 * count, 2)]


async def start(dut, khz=1000):
    bus = Bus(dut, khz)
    await reset(dut)
    return bus


async def reset(dut):
    dut.rst.value = 1
    await Timer(400, "ns")
    dut.rst.value = 0
    await Timer(1, "us")


@cocotb.test()
async def reset_values(dut):
    bus = await start(dut)
    blocks = sorted({reg["index"] // BLOCK for reg in MAP["registers"]} | {256 // BLOCK - 1})
    words = {}
    for block in blocks[SHARD::SHARDS]:
        words.update(enumerate(await bus.read(block * BLOCK, BLOCK), block * BLOCK))
    for reg in MAP["registers"]:
        value = words.get(reg["index"], reg["reset"])
        assert value & reg["mask"] == reg["reset"] & reg["mask"], reg["name"]
    for index in MAP["unknown"]:
        assert words.get(index, 0) == 0, index


@cocotb.test()
async def writes(dut):
    bus = await start(dut)
    vectors = [(reg, vector) for reg in MAP["registers"] for vector in reg["writes"]]
    for reg, vector in vectors[EVERY - 1::EVERY][SHARD::SHARDS]:
        what = f"{reg['name']} {vector}"
        await reset(dut)
        if vector["unlocked"]:
            assert await bus.write_word(UNLOCK, KEY) == 4, what
        acknowledged = await bus.write_word(reg["index"], vector["value"])
        assert acknowledged == (4 if vector["accepted"] else 3), what
        value, = await bus.read(reg["index"])
        assert value & reg["mask"] == vector["reads"] & reg["mask"], f"{what}: {value}"


@cocotb.test()
async def others_are_left_alone(dut):
    bus = await start(dut, 400)  # no sensor answers, at the highest speed of their branches
    assert await bus.write([0x05, 1, 2]) == 2  # no such register
    await bus.write_word(0x04, 0xBEEF)
    for address in (0x00, 0x2D, 0x6C, 0x5C, 0x5D):
        await bus.master.send_start()
        assert await bus.master.send_byte(address << 1), address
        await bus.master.send_stop()
    await bus.write([0x04, 0x12])  # half a word
    assert await bus.read(0x04) == [0xBEEF]
