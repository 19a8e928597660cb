// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_directory.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "daemon/files/atomic_file.h"
#include "daemon/files/directory_names.h"
#include "daemon/files/own_listing.h"
#include "daemon/files/standard_paths.h"
#include "daemon/session/session_pairs.h"

namespace {

const char *const guide_name = "guide.svg";

/// The first name in the directory that is not ours; "": none.
std::string foreign_name(int directory) {
    own_listing listing{};
    char **names = nullptr;
    std::string found;
    own_listing_read(directory, &listing);
    const int count = directory_names(directory, &names);
    for (int i = 0; i < count; i++) {
        const std::string name = names[i];
        if (found.empty() && name.rfind(OWN_PREFIX, 0) != 0 &&
            !own_listing_has(&listing, name.c_str())) {
            found = name;
        }
        std::free(names[i]);
    }
    std::free(names);
    own_listing_free(&listing);
    return found;
}

}  // namespace

capture_directory::~capture_directory() {
    drop();
    if (directory_ >= 0) {
        close(directory_);
    }
}

bool capture_directory::fail(std::string *error) const {
    *error = path_ + ": " + std::strerror(errno);
    return false;
}

bool capture_directory::check(std::string *error) const {
    const int directory = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory < 0) {
        return errno == ENOENT || fail(error);
    }
    const std::string foreign = session_pairs_here(path_.c_str()) ? "" : foreign_name(directory);
    close(directory);
    if (!foreign.empty()) {
        *error = path_ + " contains " + foreign +
                 " and is not a session of \"vergence calibrate capture\" (give another directory)";
    }
    return foreign.empty();
}

bool capture_directory::make(std::string *error) {
    standard_paths_make_parent(path_.c_str(), 0777);
    if (mkdir(path_.c_str(), 0777) != 0 && errno != EEXIST) {
        return fail(error);
    }
    directory_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory_ < 0) {
        return fail(error);
    }
    own_remove_abandoned(directory_, false);
    return true;
}

void capture_directory::drop() {
    if (lock_ >= 0) {
        own_proof proof{};
        proof.kind = OWN_TEMPORARY;
        own_remove(directory_, incoming_.substr(incoming_.rfind('/') + 1).c_str(), &proof);
        close(lock_);
        lock_ = -1;
    }
}

bool capture_directory::renew(std::string *error) {
    char name[OWN_NAME_BYTES];
    drop();
    lock_ = own_make_directory(directory_, name);
    incoming_ = path_ + "/" + name;
    return lock_ >= 0 || fail(error);
}

bool capture_directory::draw(const std::string &svg, std::string *error) {
    own_listing listing{};
    own_listing_read(directory_, &listing);
    const bool listed =
        own_listing_has(&listing, guide_name) ||
        (own_listing_set(&listing, guide_name, true) && own_listing_write(directory_, &listing));
    own_listing_free(&listing);
    return (listed && atomic_file_write(directory_, guide_name, 0666, svg.data(), svg.size())) ||
           fail(error);
}
