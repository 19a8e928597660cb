// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/json.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <string.h>

#include "core/invariant.h"

enum { REAL_BYTES = 32 };

static void put_file(void *stream, const char *data, size_t bytes) {
    fwrite(data, 1, bytes, stream);
}

void json_begin(struct json *json, FILE *stream) {
    json_begin_at(json, put_file, stream, false);
}

void json_begin_line(struct json *json, FILE *stream) {
    json_begin_at(json, put_file, stream, true);
}

void json_real(struct json *json, const char *name, double value, int digits) {
    INVARIANT(digits >= 1 && digits <= 17);
    char printed[REAL_BYTES];
    snprintf(printed, sizeof printed, "%.*g", digits, value);
    json_token(json, name, isfinite(value) ? printed : "null");
}

void json_reals(struct json *json, const char *name, const double *values, int count, int digits) {
    json_open_row(json, name);
    for (int i = 0; i < count; i++) {
        json_real(json, NULL, values[i], digits);
    }
    json_close_array(json);
}

struct cJSON *json_parse(const char *text) {
    return cJSON_ParseWithOpts(text, NULL, true);
}

bool json_member_text(const struct cJSON *object, const char *name, char *to, size_t bytes) {
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    if (text == NULL || strlen(text) >= bytes) {
        return false;
    }
    memcpy(to, text, strlen(text) + 1);
    return true;
}

bool json_member_integer(const struct cJSON *object, const char *name, int64_t *number) {
    const double exact = 9007199254740992.0;
    const struct cJSON *value = cJSON_GetObjectItemCaseSensitive(object, name);
    if (!cJSON_IsNumber(value) || !(fabs(value->valuedouble) <= exact) ||
        value->valuedouble != floor(value->valuedouble)) {
        return false;
    }
    *number = (int64_t)value->valuedouble;
    return true;
}

bool json_member_true(const struct cJSON *object, const char *name) {
    return cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(object, name));
}
