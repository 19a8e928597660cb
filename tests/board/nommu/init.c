// SPDX-License-Identifier: Apache-2.0
// The first process of the machine without an MMU: mounts what the daemon reads and becomes the
// daemon, as nothing may fork there. Its arguments are the daemon's.
#include <stdio.h>
#include <sys/mount.h>
#include <unistd.h>

int main(int count, char *arguments[]) {
    (void)count;
    if (mount("proc", "/proc", "proc", 0, NULL) != 0) {
        perror("init: /proc");
    }
    arguments[0] = "/bin/vergenced";
    execv(arguments[0], arguments);
    perror("init: /bin/vergenced");
    return 1;
}
