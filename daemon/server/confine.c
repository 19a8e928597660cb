// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/confine.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>
#include <sys/prctl.h>

#include "core/error.h"

#ifdef VERGENCE_SECCOMP

#include <linux/i2c-dev.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

/// The allowed calls. No new programs, other processes, tracing, mounting or change of user;
/// sockets only of the families below, and device requests only from `requests`.
static const int allowed[] = {
    // Memory and threads. Reconstruction threads start later and end with the job, so clone is
    // allowed for threads only (below). A thread pool started before confinement would keep its
    // stacks on a small board and gain nothing: a thread has the rights of its process, and the
    // filter applies to new threads.
    SCMP_SYS(brk),
    SCMP_SYS(mmap),
    SCMP_SYS(mmap2),
    SCMP_SYS(munmap),
    SCMP_SYS(mremap),
    SCMP_SYS(mprotect),
    SCMP_SYS(madvise),
    SCMP_SYS(futex),
    SCMP_SYS(futex_time64),
    SCMP_SYS(set_robust_list),
    SCMP_SYS(rseq),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
    SCMP_SYS(sched_yield),
    SCMP_SYS(sched_getaffinity),
    SCMP_SYS(gettid),
    SCMP_SYS(getpid),
    SCMP_SYS(tgkill),
    SCMP_SYS(getrandom),
    SCMP_SYS(getrusage),
    SCMP_SYS(sysinfo),
    SCMP_SYS(uname),
    // Signals and time.
    SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sigaltstack),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(clock_gettime),
    SCMP_SYS(clock_gettime64),
    SCMP_SYS(clock_nanosleep),
    SCMP_SYS(clock_nanosleep_time64),
    SCMP_SYS(nanosleep),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(time),
    // Files, devices, terminals.
    SCMP_SYS(read),
    SCMP_SYS(write),
    SCMP_SYS(readv),
    SCMP_SYS(writev),
    SCMP_SYS(pread64),
    SCMP_SYS(pwrite64),
    SCMP_SYS(open),
    SCMP_SYS(openat),
    SCMP_SYS(openat2),
    SCMP_SYS(close),
    SCMP_SYS(lseek),
    SCMP_SYS(_llseek),
    SCMP_SYS(fcntl),
    SCMP_SYS(fcntl64),
    SCMP_SYS(dup),
    SCMP_SYS(fstat),
    SCMP_SYS(fstat64),
    SCMP_SYS(stat),
    SCMP_SYS(stat64),
    SCMP_SYS(lstat),
    SCMP_SYS(lstat64),
    SCMP_SYS(newfstatat),
    SCMP_SYS(fstatat64),
    SCMP_SYS(statx),
    SCMP_SYS(statfs),
    SCMP_SYS(fstatfs),
    SCMP_SYS(fstatfs64),
    SCMP_SYS(access),
    SCMP_SYS(faccessat),
    SCMP_SYS(faccessat2),
    SCMP_SYS(readlink),
    SCMP_SYS(readlinkat),
    SCMP_SYS(getdents),
    SCMP_SYS(getdents64),
    SCMP_SYS(getcwd),
    SCMP_SYS(mkdir),
    SCMP_SYS(mkdirat),
    SCMP_SYS(rmdir),
    SCMP_SYS(unlink),
    SCMP_SYS(unlinkat),
    SCMP_SYS(rename),
    SCMP_SYS(renameat),
    SCMP_SYS(renameat2),
    SCMP_SYS(linkat),
    SCMP_SYS(ftruncate),
    SCMP_SYS(ftruncate64),
    SCMP_SYS(fallocate),
    SCMP_SYS(fsync),
    SCMP_SYS(fdatasync),
    SCMP_SYS(sync_file_range),
    SCMP_SYS(flock),
    SCMP_SYS(utimensat),
    SCMP_SYS(copy_file_range),
    SCMP_SYS(sendfile),
    // Waiting for events.
    SCMP_SYS(poll),
    SCMP_SYS(ppoll),
    SCMP_SYS(ppoll_time64),
    SCMP_SYS(select),
    SCMP_SYS(pselect6),
    SCMP_SYS(eventfd2),
    SCMP_SYS(signalfd4),
    SCMP_SYS(timerfd_create),
    SCMP_SYS(timerfd_settime),
    SCMP_SYS(pipe2),
    // New clients, and reconnecting to a simulated rig.
    SCMP_SYS(accept),
    SCMP_SYS(accept4),
    SCMP_SYS(connect),
    SCMP_SYS(send),  // separate calls on 32-bit ARM, used by its C library
    SCMP_SYS(recv),
    SCMP_SYS(sendto),
    SCMP_SYS(recvfrom),
    SCMP_SYS(sendmsg),
    SCMP_SYS(recvmsg),
    SCMP_SYS(shutdown),
    SCMP_SYS(getsockopt),
    SCMP_SYS(setsockopt),
    SCMP_SYS(getsockname),
    SCMP_SYS(getpeername),
};

// Masks: the whole request, letter and number, letter and one direction, or the letter. The upper
// half of a register is not compared: the kernel ignores it.
enum { LETTER = _IOC_TYPEMASK << _IOC_TYPESHIFT, NUMBER = _IOC_NRMASK << _IOC_NRSHIFT };
#define WHOLE UINT32_MAX

/// Allowed ioctl requests. For terminals: settings and owner, but not injecting input (TIOCSTI,
/// TIOCLINUX).
static const struct {
    uint32_t mask, request;
} requests[] = {
    {WHOLE, TCGETS},
    {WHOLE, TCSETS},
    {WHOLE, TCSETSW},
    {WHOLE, TCSETSF},
    // The same with arbitrary baud rates, used by newer C libraries.
    {LETTER | NUMBER, _IOC(0U, 'T', 0x2A, 0)},
    {LETTER | NUMBER, _IOC(0U, 'T', 0x2B, 0)},
    {LETTER | NUMBER, _IOC(0U, 'T', 0x2C, 0)},
    {LETTER | NUMBER, _IOC(0U, 'T', 0x2D, 0)},
    {WHOLE, TCFLSH},
    {WHOLE, TIOCEXCL},
    {WHOLE, TIOCNXCL},
    {WHOLE, I2C_RDWR},
    {WHOLE, I2C_FUNCS},
    {WHOLE, I2C_TIMEOUT},
    {WHOLE, I2C_RETRIES},
    // Cameras. Console requests share the letter but have no direction.
    {LETTER | _IOC(_IOC_READ, 0, 0, 0), _IOC(_IOC_READ, 'V', 0, 0)},
    {LETTER | _IOC(_IOC_WRITE, 0, 0, 0), _IOC(_IOC_WRITE, 'V', 0, 0)},
    {LETTER, _IOC(0U, 'W', 0, 0)},   // watchdogs
    {LETTER, _IOC(0U, 0xB4, 0, 0)},  // gpiochip lines
};

/// Allows a call whose argument has these bits under the mask.
static int allow_masked(scmp_filter_ctx filter, int call, unsigned argument, scmp_datum_t mask,
                        scmp_datum_t bits) {
    const struct scmp_arg_cmp same = {
        .arg = argument, .op = SCMP_CMP_MASKED_EQ, .datum_a = mask, .datum_b = bits};
    return seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, call, 1, &same);
}

static int add_rules(scmp_filter_ctx filter) {
    int error = 0;
    for (size_t i = 0; error == 0 && i < sizeof allowed / sizeof allowed[0]; i++) {
        error = seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0);
        // Calls that this architecture does not have are not an error.
        error = error == -EDOM || error == -EOPNOTSUPP ? 0 : error;
    }
    // Threads, but no processes. The filter cannot see the flags of clone3; without clone3 the C
    // library falls back to clone.
    if (error == 0) {
        error = seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
    }
    if (error == 0) {
        error = allow_masked(filter, SCMP_SYS(clone), 0, CLONE_THREAD, CLONE_THREAD);
    }
    for (size_t i = 0; error == 0 && i < sizeof requests / sizeof requests[0]; i++) {
        error = allow_masked(filter, SCMP_SYS(ioctl), 1, requests[i].mask, requests[i].request);
    }
    static const unsigned families[] = {AF_UNIX, AF_INET};
    for (size_t i = 0; error == 0 && i < sizeof families / sizeof families[0]; i++) {
        const struct scmp_arg_cmp same = {.arg = 0, .op = SCMP_CMP_EQ, .datum_a = families[i]};
        error = seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, SCMP_SYS(socket), 1, &same);
    }
    return error;
}

int confine_process(struct message *message) {
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (filter == NULL) {
        return message_set(message, ERROR_MEMORY, "confinement: out of memory");
    }
    int error = seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    if (error == 0) {
        error = add_rules(filter);
    }
    if (error == 0) {
        error = seccomp_load(filter);
    }
    seccomp_release(filter);
    if (error != 0) {
        return message_set(message, ERROR_IO,
                           "confinement: refused by the system: %s (\"confine = no\" disables it)",
                           strerror(-error));
    }
    return 0;
}

#else

int confine_process(struct message *message) {
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) {
        return message_set(message, ERROR_IO, "confinement: %s", strerror(errno));
    }
    return message_set(message, ERROR_UNSUPPORTED,
                       "built without libseccomp (Debian: libseccomp-dev): "
                       "system calls are not confined");
}

#endif
