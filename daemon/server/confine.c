// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/confine.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>
#include <sys/prctl.h>

#include "core/error.h"

#ifdef VERGENCE_SECCOMP

#include <linux/i2c-dev.h>
#include <linux/ioctl.h>
#include <mtd/mtd-user.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

/// The allowed calls. No new programs, other processes, tracing, mounting or change of user;
/// sockets only of the families below, and device requests only from `requests`.
///
/// Reconstruction threads start later and end with the job, so clone is allowed for threads only
/// (below). A thread pool started before confinement would keep its stacks on a small board and
/// gain nothing: a thread has the rights of its process, and the filter applies to new threads.
static const char allowed[] =
    // Memory and threads.
    "brk mmap mmap2 munmap mremap mprotect madvise futex futex_time64 set_robust_list rseq exit "
    "exit_group sched_yield sched_getaffinity gettid getpid tgkill getrandom getrusage sysinfo "
    "uname "
    // Signals and time.
    "rt_sigaction rt_sigprocmask rt_sigreturn sigaltstack restart_syscall clock_gettime "
    "clock_gettime64 clock_nanosleep clock_nanosleep_time64 nanosleep gettimeofday time "
    // Files, devices, terminals.
    "read write readv writev pread64 pwrite64 open openat openat2 close lseek _llseek fcntl "
    "fcntl64 dup fstat fstat64 stat stat64 lstat lstat64 newfstatat fstatat64 statx statfs fstatfs "
    "fstatfs64 access faccessat faccessat2 readlink readlinkat getdents getdents64 getcwd mkdir "
    "mkdirat rmdir unlink unlinkat rename renameat renameat2 linkat ftruncate ftruncate64 "
    "fallocate fsync fdatasync sync_file_range flock utimensat copy_file_range sendfile "
    // Waiting for events.
    "poll ppoll ppoll_time64 select pselect6 eventfd2 signalfd4 timerfd_create timerfd_settime "
    "pipe2 "
    // Sockets; send and recv are used by the C library of 32-bit ARM.
    "accept accept4 connect send recv sendto recvfrom sendmsg recvmsg shutdown getsockopt "
    "setsockopt getsockname getpeername ";

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
    // Flash: what it is, and erasing.
    {WHOLE, MEMGETINFO},
    {WHOLE, MEMERASE},
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
    char names[sizeof allowed];
    char *rest = NULL;
    int error = 0;
    memcpy(names, allowed, sizeof names);
    for (char *name = strtok_r(names, " ", &rest); error == ERROR_OK && name != NULL;
         name = strtok_r(NULL, " ", &rest)) {
        // Calls that this architecture or libseccomp does not have are not an error.
        const int call = seccomp_syscall_resolve_name(name);
        error = call == __NR_SCMP_ERROR ? 0 : seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0);
        error = error == -EDOM || error == -EOPNOTSUPP ? 0 : error;
    }
    // Threads, but no processes. The filter cannot see the flags of clone3; without clone3 the C
    // library falls back to clone.
    if (error == ERROR_OK) {
        error = seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
    }
    if (error == ERROR_OK) {
        error = allow_masked(filter, SCMP_SYS(clone), 0, CLONE_THREAD, CLONE_THREAD);
    }
    for (size_t i = 0; error == ERROR_OK && i < sizeof requests / sizeof requests[0]; i++) {
        error = allow_masked(filter, SCMP_SYS(ioctl), 1, requests[i].mask, requests[i].request);
    }
    static const unsigned families[] = {AF_UNIX, AF_INET};
    for (size_t i = 0; error == ERROR_OK && i < sizeof families / sizeof families[0]; i++) {
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
    if (error == ERROR_OK) {
        error = add_rules(filter);
    }
    if (error == ERROR_OK) {
        error = seccomp_load(filter);
    }
    seccomp_release(filter);
    if (error != ERROR_OK) {
        return message_set(message, ERROR_IO,
                           "confinement: refused by the system: %s (\"confine = no\" disables it)",
                           strerror(-error));
    }
    return ERROR_OK;
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
