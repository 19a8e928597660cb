// SPDX-License-Identifier: Apache-2.0
// Runs a program with a service manager's restrictions: service_filter FILE PROGRAM [ARGUMENT...].
// FILE has one entry per line: an allowed system call, "family N" for an allowed socket family, or
// "no-write-execute" to forbid memory that is writable and executable. Every other system call
// kills the program with SIGSYS, as systemd does unless the unit names an error, so that a missing
// call is noticed.
#include <seccomp.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

void demand(int error, const std::string &what) {
    if (error != 0) {
        throw std::runtime_error(what + ": " + std::strerror(-error));
    }
}

// Calls that this architecture does not have are skipped, as in the service manager.
void allow(scmp_filter_ctx filter, const std::string &name) {
    const int call = seccomp_syscall_resolve_name(name.c_str());
    if (call == __NR_SCMP_ERROR) {
        return;
    }
    const int error = seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0);
    demand(error == -EDOM || error == -EOPNOTSUPP ? 0 : error, name);
}

// In addition to the first filter: with several filters the strictest decision applies.
void load_families(const std::vector<unsigned> &families) {
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    constexpr unsigned kMax = 64;  // more than exist
    for (unsigned family = 0; family < kMax; family++) {
        bool allowed = false;
        for (const unsigned one : families) {
            allowed = allowed || one == family;
        }
        if (!allowed) {
            demand(seccomp_rule_add(filter, SCMP_ACT_ERRNO(EAFNOSUPPORT), SCMP_SYS(socket), 1,
                                    SCMP_A0(SCMP_CMP_EQ, family, 0)),
                   "socket");
        }
    }
    demand(seccomp_load(filter), "families");
    seccomp_release(filter);
}

void load_no_write_execute() {
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    constexpr scmp_datum_t kBoth = PROT_WRITE | PROT_EXEC;
    demand(seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(mmap), 1,
                            SCMP_A2(SCMP_CMP_MASKED_EQ, kBoth, kBoth)),
           "mmap");
    for (const int call : {SCMP_SYS(mprotect), SCMP_SYS(pkey_mprotect)}) {
        demand(seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), call, 1,
                                SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, PROT_EXEC)),
               "mprotect");
    }
    demand(seccomp_load(filter), "no-write-execute");
    seccomp_release(filter);
}

void load(const char *path) {
    std::ifstream file(path);
    if (!file) {
        throw std::runtime_error(std::string(path) + ": cannot be read");
    }
    scmp_filter_ctx calls = seccomp_init(SCMP_ACT_KILL_PROCESS);
    std::vector<unsigned> families;
    bool no_write_execute = false;
    for (std::string word; file >> word;) {
        if (word == "family") {
            families.push_back(0);
            file >> families.back();
        } else if (word == "no-write-execute") {
            no_write_execute = true;
        } else {
            allow(calls, word);
        }
    }
    // The filter of the calls comes last: it may not allow another filter.
    if (!families.empty()) {
        load_families(families);
    }
    if (no_write_execute) {
        load_no_write_execute();
    }
    demand(seccomp_load(calls), "filter");
    seccomp_release(calls);
}

}  // namespace

int main(int argc, char **argv) {
    if (argc < 3) {
        std::fputs("usage: service_filter FILE PROGRAM [ARGUMENT...]\n", stderr);
        return 2;
    }
    try {
        load(argv[1]);
    } catch (const std::exception &why) {
        std::fprintf(stderr, "service_filter: %s\n", why.what());
        return 2;
    }
    execv(argv[2], argv + 2);
    std::fprintf(stderr, "service_filter: %s: %s\n", argv[2], std::strerror(errno));
    return 2;
}
