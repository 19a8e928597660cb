// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/server.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/serial_device.h"
#include "daemon/files/own_remove.h"
#include "daemon/server/listener.h"
#include "daemon/server/notify.h"

enum {
    CONSOLE = 0,  ///< index in `clients`
    UNIX = 0,     ///< indices in `listeners`
    TCP = 1,
    TICK_MS = 250,  ///< maximum time of one poll()
    FDS_MAX = 2 + LISTENERS + 2 * (CONFIG_CLIENTS_MAX + 1),
    STUCK_SIMULATED_S = 150,  ///< a simulated rig renders its frames, which takes long
    GREETING_US = 10000000,   ///< time limit for a client's first valid line
};

/// Makes signals readable from a descriptor. Threads started later inherit the mask.
static bool open_signals(struct server *self) {
    sigset_t taken;
    sigemptyset(&taken);
    sigaddset(&taken, SIGINT);
    sigaddset(&taken, SIGTERM);
    sigaddset(&taken, SIGHUP);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);  // a file size limit is handled like a full disk
    if (pthread_sigmask(SIG_BLOCK, &taken, NULL) != 0) {
        return false;
    }
    self->signal_fd = signalfd(-1, &taken, SFD_CLOEXEC | SFD_NONBLOCK);
    self->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    return self->signal_fd >= 0 && self->wake_fd >= 0;
}

static bool open_clients(struct server *self) {
    const size_t count = self->daemon->config.clients + 1;
    INVARIANT(count <= CONFIG_CLIENTS_MAX + 1);
    while (self->client_count < count) {
        struct connection *client = calloc(1, sizeof *client);
        if (client == NULL) {
            return false;
        }
        self->clients[self->client_count++] = client;
        if (!connection_init(client, &self->dispatch, self->wake_fd)) {
            return false;
        }
    }
    reply_init(&self->dispatch.reply);
    return true;
}

int server_open(struct server *self, struct daemon *daemon, struct message *message) {
    const struct config *config = &daemon->config;
    *self = (struct server){.daemon = daemon,
                            .dispatch = {.daemon = daemon},
                            .notify_us = notify_period_us(),
                            .listeners = {-1, -1},
                            .signal_fd = -1,
                            .wake_fd = -1};
    if (!open_signals(self)) {
        return message_set(message, ERROR_IO, "cannot wait for signals: %s", strerror(errno));
    }
    if (!open_clients(self)) {
        return message_set(message, ERROR_MEMORY, "out of memory for %u clients",
                           (unsigned)config->clients);
    }
    const int error = listener_open(config, self->listeners, self->token, message);
    return error != ERROR_OK
               ? error
               : console_open(&self->console, config, self->clients[CONSOLE], message);
}

int server_start(struct server *self, struct message *message) {
    struct daemon *daemon = self->daemon;
    const size_t queue = daemon->config.queue;
    daemon->started_us = monotonic_now_us();
    if (!worker_start(&daemon->rig_worker, daemon, self->wake_fd, queue) ||
        !worker_start(&daemon->general_worker, daemon, self->wake_fd, queue)) {
        return message_set(message, ERROR_IO, "cannot start a thread: %s", strerror(errno));
    }
    return ERROR_OK;
}

static void take_signals(struct server *self) {
    struct signalfd_siginfo information;
    while (read(self->signal_fd, &information, sizeof information) == sizeof information) {
        if (information.ssi_signo == SIGHUP) {
            log_ring_reopen(&self->daemon->log_ring);
        } else {
            log_ring_print(&self->daemon->log_ring, HAL_LOG_NOTICE, "signal %u: ending",
                           information.ssi_signo);
            self->stopping = true;
        }
    }
}

/// Closes the client's descriptors, except standard input and output.
static void hang_up(struct server *self, struct connection *client) {
    if (client->lasting) {
        serial_device_close(client->in_fd);
    } else if (!console_is_stdio(&self->console, client)) {
        close(client->in_fd);
    }
}

static void close_client(struct server *self, struct connection *client) {
    INVARIANT(client->used && atomic_load(&client->job.state) != JOB_WAITING);
    self->stopping = self->stopping || console_is_stdio(&self->console, client);
    hang_up(self, client);
    output_reset(&client->output, true);
    INVARIANT(client->payload.data == NULL);
    client->used = false;
    if (client->lasting) {
        console_left(&self->console, client->gone);
    }
}

/// A slot for a new client: an unused one, else that of the longest-connected client that has not
/// greeted. NULL: all have greeted.
static struct connection *free_slot(struct server *self) {
    struct connection *silent = NULL;
    for (size_t i = CONSOLE + 1; i < self->client_count; i++) {
        struct connection *client = self->clients[i];
        if (!client->used) {
            return client;
        }
        if (!client->greeted && (silent == NULL || client->begun_us < silent->begun_us)) {
            silent = client;
        }
    }
    if (silent != NULL) {
        connection_gone(silent);
        close_client(self, silent);
    }
    return silent;
}

/// Whether all slots are used and one becomes free as soon as its last command ends.
static bool slot_is_due(const struct server *self) {
    bool due = false;
    for (size_t i = CONSOLE + 1; i < self->client_count; i++) {
        const struct connection *client = self->clients[i];
        if (!client->used || !client->greeted) {
            return false;
        }
        due = due || client->gone || (client->ended && !client->job.watch.on);
    }
    return due;
}

/// Drops a client that did not greet in time.
static void end_silence(struct server *self, struct connection *client, uint64_t now_us) {
    if (client->greeted || client->gone || now_us - client->begun_us <= GREETING_US) {
        return;
    }
    client->hangs_up = "sent no valid line";
    client->job.request = (struct request){.json = false};
    dispatch_answer(&self->dispatch, &client->job, ERROR_TIMEOUT, "no valid line within 10 s");
    connection_send(client, now_us);
    connection_gone(client);
}

/// Drops a client that does not read its answers.
static void end_stall(struct server *self, struct connection *client, uint64_t now_us) {
    const uint64_t timeout_us = (uint64_t)self->daemon->config.reader_timeout_s * 1000000;
    const bool stalled = client->stalled_us != 0 && now_us - client->stalled_us > timeout_us;
    // Nothing waits for a client on the daemon's own output, so it may read as slowly as it likes.
    const bool own = console_is_stdio(&self->console, client);
    if (client->gone || own || (!stalled && !output_overrun(&client->output))) {
        return;
    }
    if (client->lasting) {
        output_reset(&client->output, false);  // no terminal is connected
        client->stalled_us = 0;
    } else {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_WARNING, "a client does not read: dropped");
        connection_gone(client);
    }
}

/// Reads, runs and writes for one client.
static void serve(struct server *self, struct connection *client, short input, short output,
                  uint64_t now_us) {
    if (!client->used) {
        return;
    }
    connection_read(client, input);
    if ((output & (POLLERR | POLLNVAL)) != 0) {
        connection_gone(client);
    }
    connection_step(client, now_us);
    if (atomic_load(&client->job.state) == JOB_WAITING) {
        worker_report_wait(client->job.worker, &client->job, &self->dispatch.reply, now_us);
    }
    connection_send(client, now_us);
    end_stall(self, client, now_us);
    end_silence(self, client, now_us);
    connection_step(client, now_us);
    if (client->hangs_up != NULL) {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_WARNING, "a client %s: dropped",
                       client->hangs_up);
        client->hangs_up = NULL;
    }
    if (connection_over(client)) {
        close_client(self, client);
    }
}

/// Accepts only one client: poll() must report closed clients before the next one is accepted, or a
/// client that closes and reconnects could find its old slot still in use.
static void accept_client(struct server *self, int listener_index, uint64_t now_us) {
    const int listener = self->listeners[listener_index];
    INVARIANT(listener >= 0);
    if (slot_is_due(self)) {
        return;
    }
    const int fd = listener_accept(listener);
    if (fd < 0) {
        self->accept_us = now_us + (uint64_t)TICK_MS * 1000;
        return;
    }
    char host[LISTENER_HOST_BYTES];
    if (listener_index == LISTENER_TCP && !listener_admits(&self->daemon->config, fd, host)) {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_WARNING,
                       "a client at %s, outside of tcp_network: refused", host);
        listener_turn_away(fd, "ERR REFUSED your address is not in the setting \"tcp_network\"\n");
        return;
    }
    struct connection *slot = free_slot(self);
    if (slot == NULL) {
        listener_turn_away(fd, "ERR BUSY too many clients: try again later\n");
        return;
    }
    connection_begin(slot, false, fd, fd);
    connection_await_greeting(slot, listener_index == LISTENER_TCP ? self->token : NULL, now_us);
    // Its first line may have arrived already; a client that has greeted keeps the slot.
    serve(self, slot, POLLIN, 0, now_us);
}

/// Collects the descriptors to poll; stores the indices of each client's in `at` (-1: not polled).
static nfds_t gather(struct server *self, struct pollfd *fds, int at[][2]) {
    nfds_t count = 0;
    fds[count++] = (struct pollfd){.fd = self->signal_fd, .events = POLLIN};
    fds[count++] = (struct pollfd){.fd = self->wake_fd, .events = POLLIN};
    const bool waits = slot_is_due(self) || monotonic_now_us() < self->accept_us;
    const short accepting = waits ? 0 : POLLIN;
    for (int i = 0; i < LISTENERS; i++) {
        fds[count++] = (struct pollfd){.fd = self->listeners[i], .events = accepting};
    }
    for (size_t i = 0; i < self->client_count; i++) {
        struct connection *client = self->clients[i];
        at[i][0] = -1;
        at[i][1] = -1;
        if (!client->used || client->gone) {
            continue;
        }
        // poll() reports a disconnected peer even without POLLIN.
        if (client->in_fd == client->out_fd || !client->ended) {
            at[i][0] = (int)count;
            const short events = connection_has_room(client) ? POLLIN : 0;
            fds[count++] = (struct pollfd){.fd = client->in_fd, .events = events};
        }
        if (connection_has_output(client)) {
            at[i][1] = (int)count;
            fds[count++] = (struct pollfd){.fd = client->out_fd, .events = POLLOUT};
        }
    }
    INVARIANT(count <= FDS_MAX);
    return count;
}

/// Time until something is due, in ms.
static int timeout_ms(const struct server *self, uint64_t now_us) {
    uint64_t due_us = now_us + (uint64_t)TICK_MS * 1000;
    // An overdue heartbeat waits for the instrument's thread and must not keep the loop spinning.
    const uint64_t notify_us = self->notified_us + self->notify_us;
    due_us = notify_us > now_us && notify_us < due_us ? notify_us : due_us;
    for (size_t i = 0; i < self->client_count; i++) {
        const uint64_t client_us = connection_due_us(self->clients[i]);
        due_us = client_us < due_us ? client_us : due_us;
    }
    return due_us <= now_us ? 0 : (int)((due_us - now_us + 999) / 1000);
}

static void feed(struct server *self) {
    if (self->daemon->watchdog == NULL) {
        return;
    }
    const int error = self->daemon->watchdog->operations->feed(self->daemon->watchdog->self);
    if (error != ERROR_OK && !self->watchdog_reported) {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_ERROR, "the watchdog cannot be fed: %s",
                       error_text(error));
    }
    self->watchdog_reported = error != ERROR_OK;
}

/// Feeds the watchdogs while the instrument's thread makes progress: the service manager's, which
/// restarts the daemon, and the system's, which resets the machine if that does not help.
static void notify(struct server *self, uint64_t now_us) {
    const bool simulated = self->daemon->config.backend == CONFIG_BACKEND_SIM;
    const unsigned stuck_s = self->daemon->config.stuck_s;
    const unsigned limit_s = simulated && stuck_s < STUCK_SIMULATED_S ? STUCK_SIMULATED_S : stuck_s;
    const bool alive = worker_silence_us(&self->daemon->rig_worker) < (uint64_t)limit_s * 1000000;
    if (!alive && !self->stuck_reported) {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_ERROR,
                       "the instrument's thread has been stuck for %u s", limit_s);
    }
    self->stuck_reported = !alive;
    if (alive && now_us - self->notified_us >= self->notify_us) {
        self->notified_us = now_us;
        notify_send("WATCHDOG=1");
        feed(self);
    }
}

static void turn(struct server *self) {
    struct pollfd fds[FDS_MAX];
    int at[CONFIG_CLIENTS_MAX + 1][2];
    const nfds_t count = gather(self, fds, at);
    const int ready = poll(fds, count, timeout_ms(self, monotonic_now_us()));
    const uint64_t now_us = monotonic_now_us();
    if (ready < 0) {
        INVARIANT(errno == EINTR || errno == ENOMEM);
        return;
    }
    uint64_t woken = 0;
    if ((fds[1].revents & POLLIN) != 0 && read(self->wake_fd, &woken, sizeof woken) < 0) {
        INVARIANT(errno == EAGAIN);
    }
    if ((fds[0].revents & POLLIN) != 0) {
        take_signals(self);
    }
    for (size_t i = 0; i < self->client_count; i++) {
        const short input = at[i][0] >= 0 ? fds[at[i][0]].revents : 0;
        const short output = at[i][1] >= 0 ? fds[at[i][1]].revents : 0;
        serve(self, self->clients[i], input, output, now_us);
    }
    for (int i = 0; i < LISTENERS; i++) {
        if ((fds[2 + i].revents & POLLIN) != 0) {
            accept_client(self, i, now_us);
        }
    }
    if (!self->stopping) {
        console_retry(&self->console, now_us);
    }
    notify(self, now_us);
    log_ring_flush(&self->daemon->log_ring);
}

int server_run(struct server *self) {
    INVARIANT(self->daemon->rig_worker.started && self->daemon->general_worker.started);
    notify_send("READY=1");
    while (!self->stopping) {
        turn(self);
    }
    notify_send("STOPPING=1");
    feed(self);  // the last feed: the instrument is made safe now
    return 0;
}

/// Sends finished answers as far as they are accepted at once.
static void close_clients(struct server *self) {
    for (size_t i = 0; i < self->client_count; i++) {
        struct connection *client = self->clients[i];
        if (client->used) {
            connection_send(client, monotonic_now_us());
            hang_up(self, client);
        }
        if (client->dispatch != NULL) {
            output_close(&client->output);
        }
        free(client);
    }
}

void server_close(struct server *self) {
    if (self->daemon == NULL) {
        return;  // never opened
    }
    worker_stop(&self->daemon->rig_worker);
    worker_stop(&self->daemon->general_worker);
    close_clients(self);
    console_close(&self->console);
    for (int i = 0; i < LISTENERS; i++) {
        if (self->listeners[i] >= 0) {
            close(self->listeners[i]);
        }
    }
    if (self->listeners[LISTENER_UNIX] >= 0) {
        own_remove(AT_FDCWD, self->daemon->config.socket, &(struct own_proof){.kind = OWN_SOCKET});
    }
    if (self->signal_fd >= 0) {
        close(self->signal_fd);
    }
    if (self->wake_fd >= 0) {
        close(self->wake_fd);
    }
}
