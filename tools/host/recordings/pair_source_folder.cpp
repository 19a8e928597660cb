// SPDX-License-Identifier: Apache-2.0
// Data sets as folders of images. Sources: Burri et al., "The EuRoC micro aerial vehicle datasets",
// IJRR 2016; Geiger et al., "Vision meets robotics: the KITTI dataset", IJRR 2013; file names that
// are times in seconds: Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS
// 2012.
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>

#include "core/error.h"
#include "daemon/files/input_file.h"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/recordings/pair_source.hpp"

namespace {

constexpr uint64_t second_ns = 1000000000, unknown_step_ns = second_ns / 10;

struct layout {
    const char *left, *right;  // folders of the images
    int first_camera;          // KITTI's number of the left camera
    /// Where a calibration may be; its partner is beside it.
    std::vector<const char *> calibrations;
};

const layout layouts[] = {
    {"mav0/cam0/data", "mav0/cam1/data", -1, {"mav0/cam0/sensor.yaml"}},
    {"cam0/data", "cam1/data", -1, {"cam0/sensor.yaml"}},
    {"image_02/data", "image_03/data", 2, {"calib_cam_to_cam.txt", "../calib_cam_to_cam.txt"}},
    {"image_00/data", "image_01/data", 0, {"calib_cam_to_cam.txt", "../calib_cam_to_cam.txt"}},
    {"image_2", "image_3", 2, {"calib.txt"}},
    {"image_0", "image_1", 0, {"calib.txt"}},
    {"left", "right", -1, {}},
    {"cam0", "cam1", -1, {}},
    {"infra1", "infra2", -1, {}},
};

bool exists(const std::string &path) {
    struct stat status;
    return stat(path.c_str(), &status) == 0;
}

/// The times of KITTI's raw recordings: 2011-09-26 13:02:25.594360375, a line an image.
std::vector<uint64_t> kitti_times(const std::string &path) {
    std::vector<uint64_t> times;
    std::ifstream stream(path);
    for (std::string line; std::getline(stream, line);) {
        std::tm at{};
        char decimals[16] = "0";
        if (std::sscanf(line.c_str(), "%4d-%2d-%2d %2d:%2d:%2d.%9[0-9]", &at.tm_year, &at.tm_mon,
                        &at.tm_mday, &at.tm_hour, &at.tm_min, &at.tm_sec, decimals) < 6) {
            break;
        }
        at.tm_year -= 1900;
        at.tm_mon -= 1;
        std::string nanoseconds = decimals;
        nanoseconds.resize(9, '0');
        times.push_back(static_cast<uint64_t>(timegm(&at)) * second_ns + std::stoul(nanoseconds));
    }
    return times;
}

class folder_source : public pair_source {
  public:
    folder_source(const pair_source_request &request, const layout &form)
        : form_(form), path_(request.path), tolerance_s_(request.tolerance_s) {
        const std::string folders[2] = {path_ + "/" + form.left, path_ + "/" + form.right};
        for (size_t side = 0; side < 2; side++) {
            images_[side] = pair_source_list(folders[side]);
            times_[side] = times_of(images_[side], folders[side] + "/../timestamps.txt");
        }
        match();
        if (pairs_.empty()) {
            throw import_failure{ERROR_MISSING, folders[0] + " and " + folders[1] +
                                                    ": no two images have the same name or time"};
        }
    }

    bool next(recorded_pair *pair) override {
        if (at_ == pairs_.size()) {
            return false;
        }
        for (size_t side = 0; side < 2; side++) {
            const size_t i = pairs_[at_][side];
            pair->side[side] = pair_source_read(images_[side].paths[i], images_[side].paths[i]);
            pair->time_ns[side] = times_[side].empty() ? at_ * unknown_step_ns : times_[side][i];
        }
        at_++;
        return true;
    }

    bool calibrate(const import_options &options, calibration *value, std::string *where) override;

  private:
    static std::vector<uint64_t> times_of(const image_names &images, const std::string &list);
    void match();

    const layout &form_;
    std::string path_;
    double tolerance_s_;
    image_names images_[2];
    std::vector<uint64_t> times_[2];  // empty: not known
    std::vector<std::array<size_t, 2>> pairs_;
    size_t at_ = 0;
};

std::vector<uint64_t> folder_source::times_of(const image_names &images, const std::string &list) {
    std::vector<uint64_t> times;
    for (const std::string &stem : images.stems) {
        uint64_t time_ns;
        if (!pair_source_time(stem, &time_ns)) {
            times = kitti_times(list);
            return times.size() == images.stems.size() ? times : std::vector<uint64_t>();
        }
        times.push_back(time_ns);
    }
    return times;
}

/// Images of one name; where names are times, those of the nearest time.
void folder_source::match() {
    for (size_t l = 0, r = 0; l < images_[0].stems.size() && r < images_[1].stems.size();) {
        const std::string &left = images_[0].stems[l], &right = images_[1].stems[r];
        uint64_t time_ns[2];
        const bool timed =
            pair_source_time(left, &time_ns[0]) && pair_source_time(right, &time_ns[1]);
        const uint64_t apart_ns =
            timed ? std::max(time_ns[0], time_ns[1]) - std::min(time_ns[0], time_ns[1]) : 0;
        if (timed ? static_cast<double>(apart_ns) <= tolerance_s_ * static_cast<double>(second_ns)
                  : left == right) {
            pairs_.push_back({l++, r++});
        } else if (timed ? time_ns[0] < time_ns[1] : left < right) {
            l++;
        } else {
            r++;
        }
    }
}

bool folder_source::calibrate(const import_options &options, calibration *value,
                              std::string *where) {
    *where = form_.calibrations.empty() ? "it has none" : "it";
    for (const char *name : form_.calibrations) {
        const std::string path = path_ + "/" + name;
        if (!exists(path)) {
            *where += " has no " + std::string(name);
            continue;
        }
        import_options how = options;
        how.first_camera = form_.first_camera;
        std::string why;
        const int code = calibration_file_load(path, how, value, nullptr, &why);
        if (code != ERROR_OK) {
            throw import_failure{code, why};
        }
        return true;
    }
    return false;
}

}  // namespace

std::unique_ptr<pair_source> pair_source_folder(const pair_source_request &request) {
    for (const layout &form : layouts) {
        if (input_file_is_directory((request.path + "/" + form.left).c_str()) &&
            input_file_is_directory((request.path + "/" + form.right).c_str())) {
            return std::make_unique<folder_source>(request, form);
        }
    }
    throw import_failure{
        ERROR_ARGUMENT, request.path +
                            ": not a recording (expected *.mcap, mav0/cam0 of EuRoC, image_02/data "
                            "or image_2 of KITTI, or folders left and right; --side-by-side for "
                            "pairs in one image)"};
}
