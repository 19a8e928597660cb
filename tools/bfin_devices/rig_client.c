/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "rig_client.h"

#include <errno.h>
#include <netdb.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "simrig_protocol.h"

static struct {
    int socket;
    bool known; /* the environment was read */
    uint16_t tag;
    int64_t now_us;
    uint8_t *memory; /* of the last reply */
    size_t capacity;
} rig = {.socket = -1};

static void fail(const char *what) {
    fprintf(stderr, "bfin-elf-run: the simulated rig: %s\n", what);
    exit(1);
}

static void transfer(void *data, size_t bytes, bool out) {
    uint8_t *at = data;
    while (bytes > 0) {
        ssize_t done = out ? write(rig.socket, at, bytes) : read(rig.socket, at, bytes);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            fail("it is gone");
        at += done;
        bytes -= done;
    }
}

void rig_put_u16(uint8_t *to, unsigned value) {
    to[0] = value;
    to[1] = value >> 8;
}

void rig_put_u32(uint8_t *to, uint32_t value) {
    rig_put_u16(to, value & 0xffff);
    rig_put_u16(to + 2, value >> 16);
}

void rig_put_u64(uint8_t *to, uint64_t value) {
    rig_put_u32(to, value);
    rig_put_u32(to + 4, value >> 32);
}

uint16_t rig_u16(const uint8_t *from) {
    return from[0] | from[1] << 8;
}

uint32_t rig_u32(const uint8_t *from) {
    return rig_u16(from) | (uint32_t)rig_u16(from + 2) << 16;
}

uint64_t rig_u64(const uint8_t *from) {
    return rig_u32(from) | (uint64_t)rig_u32(from + 4) << 32;
}

static void run(struct rig_request *request) {
    uint8_t head[SIMRIG_HEADER_BYTES];
    rig_put_u32(head, request->bytes);
    rig_put_u16(head + 4, request->type);
    rig_put_u16(head + 6, ++rig.tag);
    transfer(head, sizeof head, true);
    transfer((void *)request->body, request->bytes, true);
    transfer(head, sizeof head, false);
    size_t bytes = rig_u32(head);
    if (rig_u16(head + 4) != (request->type | SIMRIG_REPLY) || rig_u16(head + 6) != rig.tag ||
        bytes < 4 || bytes > SIMRIG_BODY_MAX)
        fail("it does not speak this protocol");
    if (bytes > rig.capacity) {
        rig.memory = realloc(rig.memory, bytes);
        rig.capacity = bytes;
        if (rig.memory == NULL)
            fail("no memory for its answer");
    }
    transfer(rig.memory, bytes, false);
    request->status = (int32_t)rig_u32(rig.memory);
    request->reply = rig.memory + 4;
    request->reply_bytes = bytes - 4;
}

static int connect_unix(const char *path) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (strlen(path) >= sizeof address.sun_path)
        fail("VERGENCE_SIMRIG is too long a path");
    strcpy(address.sun_path, path);
    if (fd < 0 || connect(fd, (struct sockaddr *)&address, sizeof address) != 0)
        fail("nothing listens at VERGENCE_SIMRIG: start simrig --listen unix:PATH first");
    return fd;
}

/* Connects to the rig that the environment names: VERGENCE_SIMRIG=unix:PATH.  */
static bool connected(void) {
    static const char prefix[] = "unix:", name[] = "bfin-elf-run";
    uint8_t hello[8 + sizeof name - 1];
    struct rig_request request = {.type = SIMRIG_HELLO, .body = hello, .bytes = sizeof hello};
    const char *where = getenv("VERGENCE_SIMRIG");
    if (rig.known)
        return rig.socket >= 0;
    rig.known = true;
    if (where == NULL)
        return false;
    if (strncmp(where, prefix, sizeof prefix - 1) != 0)
        fail("VERGENCE_SIMRIG must be unix:PATH");
    rig.socket = connect_unix(where + sizeof prefix - 1);
    rig_put_u32(hello, SIMRIG_MAGIC);
    rig_put_u16(hello + 4, SIMRIG_VERSION);
    rig_put_u16(hello + 6, SIMRIG_ROLE_BOARD);
    memcpy(hello + 8, name, sizeof name - 1);
    run(&request);
    if (request.status == SIMRIG_BAD_VERSION)
        fail("it has another version of the protocol: build both from the same sources");
    if (request.status != SIMRIG_OK)
        fail("it refused the board: is another one connected?");
    return true;
}

static void read_time(void) {
    struct rig_request request = {.type = SIMRIG_TIME};
    run(&request);
    rig.now_us = rig_u64(request.reply);
}

void rig_ask(int64_t cycles, struct rig_request *request) {
    request->status = SIMRIG_FAILED;
    request->reply_bytes = 0;
    if (!connected())
        return;
    int64_t until_us = cycles / RIG_CYCLES_PER_US;
    while (rig.now_us < until_us) {
        uint8_t body[12];
        struct rig_request advance = {.type = SIMRIG_ADVANCE, .body = body, .bytes = sizeof body};
        rig_put_u64(body, until_us);
        rig_put_u32(body + 8, 0);
        run(&advance);
        if (advance.status != SIMRIG_OK)
            fail("its time does not advance");
        rig.now_us = rig_u64(advance.reply);
    }
    if (request->type == SIMRIG_ADVANCE) {
        request->status = SIMRIG_OK;
        return;
    }
    run(request);
}

int64_t rig_time(void) {
    /* The reply to the last request stays.  */
    uint8_t *memory = rig.memory;
    size_t capacity = rig.capacity;
    if (!connected())
        return 0;
    rig.memory = NULL;
    rig.capacity = 0;
    read_time();
    free(rig.memory);
    rig.memory = memory;
    rig.capacity = capacity;
    return rig.now_us * RIG_CYCLES_PER_US;
}
