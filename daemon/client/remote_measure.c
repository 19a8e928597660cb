// SPDX-License-Identifier: Apache-2.0
// `measure NAME`: the instrument measures, the client fetches the session and makes the surface of
// it here, with everything that a PC adds: a report, and a board in view that the adjustment may
// use. `reconstruct`, and `measure` over a serial line: the client gets what the instrument
// measured, in one compact file, and makes all other files of that. Over a socket `reconstruct`
// sends the file as it is made, so that the instrument need not have room for it.
#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "console/command.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/client/client.h"
#include "daemon/client/remote.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"

#define SURFACE_FILE "surface.compact"

enum { NAME_BYTES = 256, LOCAL_WORDS_MAX = 2 * COMMAND_WORDS_MAX + 4 };

/// Options that the instrument does not have: they are for the surface made here, but for the first
/// of its pictures, too.
static const char *const local_options[] = {"out",    "board",  "square", "charuco",
                                            "marker", "length", "from",   "to"};

struct measuring {
    remote_show *show;
    void *cookie;
    // As the instrument names them; the session is not `name` while it records.
    char name[NAME_BYTES], session[NAME_BYTES], result[NAME_BYTES];
    struct cJSON *answer;     // the whole answer as parsed JSON
    bool is_measure;          // else `reconstruct`
    struct atomic_file file;  // of the bytes that came before the answer
    uint64_t received;        // number of these
    int error_number;         // errno of the failure to write them; 0: none
};

/// Which local option a word is, as `NAME=...` or `--NAME`; < 0: none. `*has_value`: it contains
/// the value.
static int find_local(const char *word, bool *has_value) {
    const char *name = strncmp(word, "--", 2) == 0 ? word + 2 : word;
    const size_t length = strcspn(name, "=");
    *has_value = name[length] == '=';
    for (int i = 0; i < (int)(sizeof local_options / sizeof local_options[0]); i++) {
        if (strlen(local_options[i]) == length && strncmp(name, local_options[i], length) == 0) {
            return name != word || *has_value ? i : -1;
        }
    }
    return -1;
}

/// A command line, split into what the instrument gets and the options of the local command.
struct parts {
    char request[REMOTE_REQUEST_BYTES];
    char *local[COMMAND_WORDS_MAX];  // "--NAME", "VALUE" or "--NAME=VALUE", in `storage`
    int local_count;
    size_t used;
    char storage[COMMAND_LINE_MAX + 3 * COMMAND_WORDS_MAX];
};

static void add_local(struct parts *parts, const char *lead, const char *word) {
    char *text = parts->storage + parts->used;
    const size_t room = sizeof parts->storage - parts->used;
    const int length = snprintf(text, room, "%s%s", lead, word);
    INVARIANT(length >= 0 && (size_t)length < room && parts->local_count < COMMAND_WORDS_MAX);
    parts->local[parts->local_count++] = text;
    parts->used += (size_t)length + 1;
}

/// False: too long.
static bool add_request(struct parts *parts, const char *word, bool quoted) {
    char again[REMOTE_REQUEST_BYTES];
    const size_t length = strlen(parts->request);
    if (quoted && !remote_quote(word, again)) {
        return false;
    }
    const int more = snprintf(parts->request + length, sizeof parts->request - length, "%s%s",
                              length > 0 ? " " : "", quoted ? again : word);
    return length + (size_t)more < sizeof parts->request;
}

/// Checks what would otherwise be found only after the instrument has measured, too.
static int split(const struct command_words *words, bool has_pictures, struct parts *parts,
                 struct message *message) {
    *parts = (struct parts){.local_count = 0};
    for (size_t i = 0; i < words->count; i++) {
        const char *word = words->word[i];
        const bool quoted = (words->quoted >> i & 1) != 0;
        bool has_value = false;
        const int local = i == 0 || quoted ? -1 : find_local(word, &has_value);
        if (local < 0) {
            if (!add_request(parts, word, quoted)) {
                return message_set(message, ERROR_SYNTAX, "command too long");
            }
            continue;
        }
        if (local > 0 && !has_pictures) {
            return message_set(message, ERROR_ARGUMENT,
                               "%s: %s requires the pictures, which stay at the instrument",
                               words->word[0], word);
        }
        add_local(parts, word[0] == '-' ? "" : "--", word);
        if (!has_value && i + 1 == words->count) {
            return message_set(message, ERROR_MISSING, "measure: %s requires a value", word);
        }
        if (!has_value) {
            add_local(parts, "", words->word[++i]);
        }
    }
    return ERROR_OK;
}

static void keep_member(const char *text, const char *name, char value[NAME_BYTES]) {
    const size_t length = strlen(name);
    if (strncmp(text, name, length) == 0 && strncmp(text + length, ": ", 2) == 0) {
        snprintf(value, NAME_BYTES, "%s", text + length + 2);
    }
}

/// Shows the answer except for its end, and keeps what it names.
static void hold_back(struct remote *self, void *cookie, const char *text) {
    struct measuring *measuring = cookie;
    char event[32];
    if (measuring->error_number != 0) {
        return;  // the command was cancelled for it
    }
    if (self->json) {
        struct cJSON *all = json_parse(text);
        const struct cJSON *result = cJSON_GetObjectItemCaseSensitive(all, "result");
        if (!json_member_text(all, "event", event, sizeof event) && json_member_true(all, "ok")) {
            json_member_text(result, "name", measuring->name, NAME_BYTES);
            json_member_text(result, "session", measuring->session, NAME_BYTES);
            json_member_text(result, "result", measuring->result, NAME_BYTES);
            cJSON_Delete(measuring->answer);
            measuring->answer = all;
            return;
        }
        cJSON_Delete(all);
    } else {
        keep_member(text, "name", measuring->name);
        keep_member(text, "session", measuring->session);
        keep_member(text, "result", measuring->result);
    }
    if (self->json || strcmp(text, "OK") != 0) {
        measuring->show(self, measuring->cookie, text);
    }
}

/// Whether it is a plain name, which leads nowhere else.
static bool is_plain(const char *name) {
    return name[0] != '\0' && name[0] != '.' && name[0] != '-' && strchr(name, '/') == NULL;
}

/// The words of `vergence measure SESSION`. Returns their number.
static int make_words(const struct remote *self, char *session, const struct parts *parts,
                      char *words[LOCAL_WORDS_MAX]) {
    static char name[] = "measure", quiet[] = "--quiet";
    int count = 0;
    words[count++] = name;
    words[count++] = session;
    for (int i = 0; i < parts->local_count; i++) {
        words[count++] = parts->local[i];
    }
    if (self->json) {
        words[count++] = quiet;
    }
    INVARIANT(count < LOCAL_WORDS_MAX);
    words[count] = NULL;
    return count;
}

/// Runs a command of this program, which Ctrl-C ends as usual. Returns its exit code.
static int run_here(const struct client_command *command, int count, char **words) {
    sigset_t taken, before;
    sigemptyset(&taken);
    sigaddset(&taken, SIGINT);
    sigprocmask(SIG_UNBLOCK, &taken, &before);
    const int code = command->run(count, words);
    interrupt_release();  // the prompt continues
    sigprocmask(SIG_SETMASK, &before, NULL);
    return code;
}

/// Writes what comes before the answer, which has the name for it.
static void take(struct remote *self, void *cookie, const void *bytes, size_t length) {
    struct measuring *measuring = cookie;
    struct atomic_file *file = &measuring->file;
    if (measuring->error_number != 0) {
        return;
    }
    if ((file->fd < 0 && !atomic_file_begin(file, AT_FDCWD, SURFACE_FILE, 0644)) ||
        !write_all(file->fd, bytes, length)) {
        measuring->error_number = errno;
        remote_line_send(&self->line, "\003", 1);
    }
    measuring->received += length;
}

static void show_file(struct remote *self, const struct measuring *measuring,
                      const struct remote_written *written) {
    if (self->json) {
        struct cJSON *result = cJSON_GetObjectItemCaseSensitive(measuring->answer, "result");
        cJSON_AddStringToObject(result, "fetched", written->name);
    } else {
        remote_show_written(self, measuring->show, measuring->cookie, written);
    }
}

/// Fetches a file or a directory, and shows that.
static int fetch(struct remote *self, const struct measuring *measuring, const char *name,
                 const char *local, const char *then, struct message *message) {
    static struct remote_written written;
    const int error = remote_fetch_result(self, name, local, then, &written, message);
    if (error == ERROR_OK) {
        show_file(self, measuring, &written);
    }
    return error;
}

/// Gives the file that came with the answer a name that is free here, and shows it.
static int keep_file(struct remote *self, struct measuring *measuring, const char *name,
                     char *local, size_t bytes, struct message *message) {
    static struct remote_written written;
    remote_free_name(name, local, bytes);
    measuring->file.name = local;
    if (!atomic_file_end(&measuring->file, true)) {
        return message_set(message, file_error(errno), "%s: %s", local, strerror(errno));
    }
    written = (struct remote_written){.bytes = measuring->received};
    snprintf(written.name, sizeof written.name, "%s", local);
    show_file(self, measuring, &written);
    return ERROR_OK;
}

/// Why the surface is not made here; NULL: it is.
static const char *why_not_here(const struct remote *self, const struct measuring *measuring) {
    return measuring->session[0] == '\0'
               ? "note: the surface is the instrument's own: it keeps no session"
           : strcmp(measuring->name, measuring->session) != 0
               ? "note: the surface is the instrument's own: after \"record stop\" fetch the "
                 "recording, of which \"vergence measure\" makes one here"
           : self->line.serial
               ? "note: over a serial line the surface is the instrument's own (fetch the session "
                 "over a network to make one here)"
           : self->measure == NULL
               ? "note: the surface is the instrument's own: this program makes none"
               : NULL;
}

/// Makes all files of the instrument's surface here, of its compact form, which came with the
/// answer or is fetched: in a directory of the surface's name, or as the option out says. That file
/// goes once they are there, as they contain it.
static int unpack(struct remote *self, struct measuring *measuring, const struct parts *parts,
                  struct message *message) {
    char name[NAME_BYTES + sizeof SURFACE_FILE + 1], plain[NAME_BYTES + sizeof SURFACE_FILE];
    char local[sizeof plain + 8];
    char command[] = "reconstruct", out[] = "--out", quiet[] = "--quiet", result[NAME_BYTES];
    char *words[LOCAL_WORDS_MAX] = {command, local};
    int count = 2;
    snprintf(name, sizeof name, "%s/" SURFACE_FILE, measuring->result);
    snprintf(plain, sizeof plain, "%s.compact", measuring->result);
    snprintf(local, sizeof local, "%s", plain);
    snprintf(result, sizeof result, "%s", measuring->result);
    // The last --out counts. Other options are for `measure` and the pictures, which stay there.
    words[count++] = out;
    words[count++] = result;
    for (int i = 0; i < parts->local_count; i++) {
        if (strncmp(parts->local[i], out, sizeof out - 1) == 0) {
            words[count++] = parts->local[i];
            if (strcmp(parts->local[i], out) == 0) {
                words[count++] = parts->local[++i];
            }
        }
    }
    if (self->json) {
        words[count++] = quiet;
    }
    words[count] = NULL;
    const int error = measuring->file.fd >= 0
                          ? keep_file(self, measuring, plain, local, sizeof local, message)
                          : fetch(self, measuring, name, local, command, message);
    if (error == ERROR_OK) {
        self->measure_exit = run_here(self->reconstruct, count, words);
    }
    if (error == ERROR_OK && self->measure_exit == CLIENT_OK) {
        unlink(local);
    }
    return error;
}

/// Fetches what was measured, and makes the surface here or says why not.
static int conclude(struct remote *self, struct parts *parts, struct measuring *measuring,
                    struct message *message) {
    const char *why = measuring->is_measure ? why_not_here(self, measuring) : NULL;
    // An instrument without a disk has no session.
    if ((measuring->session[0] != '\0' && !is_plain(measuring->session)) ||
        !is_plain(measuring->result)) {
        return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
    }
    int error = ERROR_OK;
    if (measuring->is_measure && why == NULL) {
        char *words[LOCAL_WORDS_MAX];
        error = fetch(self, measuring, measuring->session, NULL, "measure", message);
        if (error == ERROR_OK) {
            const int count = make_words(self, measuring->session, parts, words);
            self->measure_exit = run_here(self->measure, count, words);
        }
    } else {
        error = self->reconstruct != NULL
                    ? unpack(self, measuring, parts, message)
                    : fetch(self, measuring, measuring->result, NULL, NULL, message);
    }
    if (error == ERROR_OK && why != NULL && !self->json) {
        measuring->show(self, measuring->cookie, why);
    }
    return error;
}

static int measure(struct remote *self, struct parts *parts, struct measuring *measuring,
                   struct message *message) {
    self->shows_steps = !self->json;
    self->take = measuring->is_measure || self->line.serial ? NULL : take;
    int error = remote_ask(self, parts->request, hold_back, measuring, message);
    self->shows_steps = false;
    self->take = NULL;
    if (measuring->error_number != 0) {
        error = message_set(message, file_error(measuring->error_number), "%s: %s", SURFACE_FILE,
                            strerror(measuring->error_number));
    }
    if (error == ERROR_OK && measuring->result[0] != '\0') {  // else it was planned only
        error = conclude(self, parts, measuring, message);
    }
    if (error == ERROR_OK && (self->json || self->measure_exit == CLIENT_OK)) {
        char *text = self->json ? cJSON_PrintUnformatted(measuring->answer) : NULL;
        measuring->show(self, measuring->cookie, text != NULL ? text : "OK");
        cJSON_free(text);
    }
    return error;
}

static bool is_planned_only(const struct command_words *words) {
    bool planned = false;
    for (size_t i = 2; i < words->count; i++) {
        const char *name = words->word[i] + strspn(words->word[i], "-");
        planned = planned || (strncmp(name, "plan", 4) == 0 && (name[4] == '\0' || name[4] == '='));
    }
    return planned;
}

/// Checks the local command, and that NAME is new here. False: `*error` ends it.
static bool check_here(struct remote *self, const struct command_words *line, char *name,
                       const struct parts *parts, int *error, struct message *message) {
    char *words[LOCAL_WORDS_MAX];
    struct stat about;
    if (self->measure == NULL || self->measure->check == NULL || self->line.serial) {
        return true;
    }
    const bool missing = name[0] == '-' && strcmp(name, "--help") != 0;
    if (missing || (is_plain(name) && !is_planned_only(line) && lstat(name, &about) == 0)) {
        *error = message_set(message, ERROR_ARGUMENT,
                             missing ? "measure: NAME is missing before %s"
                                     : "measure: %s exists here (remove it, or give another name)",
                             name);
        return false;
    }
    const int code = self->measure->check(make_words(self, name, parts, words), words);
    if (code == OPTIONS_CONTINUE) {
        return true;
    }
    self->measure_exit = code;
    if (self->json) {
        *error = message_set(message, ERROR_ARGUMENT,
                             "measure: the options for the surface are wrong: see standard error");
    }
    return false;
}

int remote_measure(struct remote *self, const struct command_words *words, remote_show *show,
                   void *cookie, struct message *message) {
    static struct parts parts;
    struct measuring measuring = {.show = show,
                                  .cookie = cookie,
                                  .is_measure = strcmp(words->word[0], "measure") == 0,
                                  .file.fd = -1};
    self->measure_exit = CLIENT_OK;
    snprintf(measuring.name, NAME_BYTES, "%s", words->count > 1 ? words->word[1] : "");
    int error = split(words, measuring.is_measure && !self->line.serial, &parts, message);
    if (error == ERROR_OK && measuring.is_measure &&
        !check_here(self, words, measuring.name, &parts, &error, message)) {
        return error;
    }
    error = error == ERROR_OK ? measure(self, &parts, &measuring, message) : error;
    if (measuring.file.fd >= 0) {
        atomic_file_end(&measuring.file, false);
    }
    cJSON_Delete(measuring.answer);
    return error;
}
