// SPDX-License-Identifier: Apache-2.0
#include "console/synonyms.h"

#include <string.h>

#include "core/invariant.h"

#define COUNT(list) (sizeof(list) / sizeof(list)[0])

static const struct synonym commands[] = {
    {"focus auto", "autofocus"},
    {"af", "autofocus"},
    {"exposure auto", "autoexpose"},
    {"gain auto", "autoexpose"},
    {"iris auto", "autoexpose"},
    {"autoexposure", "autoexpose"},
    {"ae", "autoexpose"},
    {"aperture", "iris"},
    {"shutter", "exposure"},
    {"snapshot", "capture"},
    {"snap", "capture"},
    {"shoot", "capture"},
    {"photo", "capture"},
    {"grab", "capture"},
    {"preview", "view"},
    {"live", "view"},
    {"picture", "view"},
    {"depth", "reconstruct"},
    {"surface", "reconstruct"},
    {"calibrate", "calibration"},
    {"rotate", "pan"},
    {"turn", "pan"},
    {"point", "aim"},
    {"converge", "aim"},
    {"init", "bringup"},
    {"start", "bringup"},
    {"connect", "bringup"},
    {"stop", "safe"},
    {"abort", "safe"},
    {"info", "status"},
    {"state", "status"},
    {"ls", "files"},
    {"dir", "files"},
    {"list", "files"},
    {"get", "fetch"},
    {"download", "fetch"},
    {"upload", "send"},
    {"rm", "remove"},
    {"delete", "remove"},
    {"exit", "quit"},
    {"bye", "quit"},
    {"sleep", "wait"},
    {"repeat", "watch"},
    {"roi", "window"},
    {"resolution", "window"},
    {"?", "help"},
};

static const struct synonym options[] = {
    {"depth", "near far"},        {"distance", "near far"},  {"range", "near far"},
    {"min-depth", "near"},        {"max-depth", "far"},      {"depth-min", "near"},
    {"depth-max", "far"},         {"min", "near"},           {"max", "far"},
    {"disparities", "disparity"}, {"roi", "region"},         {"window", "region"},
    {"camera", "side"},           {"lens", "side"},          {"hdr", "bracket"},
    {"frames", "average"},        {"output", "out"},         {"calib", "calibration"},
    {"square-size", "square"},    {"marker-size", "marker"}, {"dictionary", "charuco"},
    {"dict", "charuco"},          {"pattern", "board"},      {"corners-size", "board"},
    {"quality", "preset"},        {"resize", "scale"},       {"host", "connect"},
    {"address", "connect"},
};

const struct synonym *synonyms_of_commands(size_t *count) {
    *count = COUNT(commands);
    INVARIANT(*count > 0);
    return commands;
}

const struct synonym *synonyms_of_options(size_t *count) {
    *count = COUNT(options);
    INVARIANT(*count > 0);
    return options;
}

const char *synonyms_command(const char *typed, const char *first) {
    const size_t length = strlen(typed);
    for (size_t i = 0; i < COUNT(commands); i++) {
        if (strncmp(commands[i].typed, typed, length) != 0) {
            continue;
        }
        const char *rest = commands[i].typed + length;
        if (*rest == '\0' || (*rest == ' ' && first != NULL && strcmp(rest + 1, first) == 0)) {
            return commands[i].meant;
        }
    }
    return NULL;
}

const char *synonyms_options(const char *typed) {
    for (size_t i = 0; i < COUNT(options); i++) {
        if (strcmp(options[i].typed, typed) == 0) {
            return options[i].meant;
        }
    }
    return NULL;
}
