/* What the API takes apart of a request: addresses, headers, paths, queries, bodies. The first byte picks which. What
 * is accepted is as the table of fields says, and nothing else is. */
#include "checks.h"

#include "daemon/http/api_request.h"

#include <stdio.h>
#include <string.h>

static const struct lumi_api_field fields[] = {
    {.name = "plan", .type = LUMI_API_STRING, .required = true, .max = 64},
    {.name = "seal", .type = LUMI_API_BOOL, .initially = true},
    {.name = "override", .type = LUMI_API_STRINGS, .max = 3},
    {.name = "title", .type = LUMI_API_STRING, .max = 8},
    {0},
};

static const struct lumi_api_field numbers[] = {
    {.name = "turn", .type = LUMI_API_INT, .max = 9},
    {.name = "wind_up", .type = LUMI_API_BOOL},
    {0},
};

static void read_numbers(const char *text, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_api_body body;
    int code = checked(lumi_api_body_parse(text, size, numbers, &body, &error), &error);

    if (code == LUMI_OK && (body.values[0].number < 0 || body.values[0].number > 9))
        abort();
    lumi_api_body_clear(&body);
}

static void read_body(const char *text, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_api_body body;
    int code = checked(lumi_api_body_parse(text, size, fields, &body, &error), &error);

    if (code == LUMI_OK) {
        if (!body.values[0].given || !body.values[0].string || strlen(body.values[0].string) > 64 ||
            (body.values[3].string && strlen(body.values[3].string) > 8) || body.values[1].string)
            abort();
        for (int i = 0; body.values[2].strings && body.values[2].strings[i]; i++)
            if (i == 3 || strlen(body.values[2].strings[i]) > LUMI_API_STRING_MAX)
                abort();
    } else if (code != LUMI_ERR_ARG && code != LUMI_ERR_FORMAT)
        abort();
    lumi_api_body_clear(&body);
}

static const struct lumi_api_field queried[] = {
    {.name = "yaw", .type = LUMI_API_NUMBER, .least = -4, .most = 4},
    {.name = "width", .type = LUMI_API_INT, .max = 4096},
    {.name = "fast", .type = LUMI_API_BOOL},
    {.name = "word", .type = LUMI_API_STRING, .max = 8},
    {0},
};

static void read_query(const char *text)
{
    struct lumi_api_body body = {0};
    struct lumi_error error = {0};

    if (checked(lumi_api_query_parse(text, queried, &body, &error), &error) == LUMI_OK &&
        (!(body.values[0].real >= -4 && body.values[0].real <= 4) || body.values[1].number > 4096 ||
         (body.values[3].string && strlen(body.values[3].string) > 8)))
        abort();
    lumi_api_body_clear(&body);
}

static void read_path(const char *text)
{
    char part[LUMI_API_STRING_MAX + 1];

    if (lumi_api_path_match("/a/{name}/b", text, part) && (!part[0] || part[0] == '.' || strchr(part, '/')))
        abort();
}

static void read_headers(int which, const char *text)
{
    struct lumi_api_listen listen;
    struct lumi_error error = {0};
    uint64_t number;
    uint32_t epoch;
    char again[64];

    if (which == 1 && checked(lumi_api_listen_parse(text, &listen, &error), &error) == LUMI_OK &&
        (listen.port < 0 || listen.port > 65535 || !listen.host[0]))
        abort();
    if (which == 2 && lumi_api_host_is_local(text) && !strchr("lL1[", text[0]))
        abort();
    if (which == 3)
        lumi_api_origin_is_own(text, "http", strchr(text, ' ') ? strchr(text, ' ') + 1 : NULL);
    if (which == 4 && lumi_api_token_matches(text, "token") && !strstr(text, "token"))
        abort();
    if (which == 5 && lumi_api_event_id_parse(text, &epoch, &number)) {
        snprintf(again, sizeof again, "%x-%llu", epoch, (unsigned long long)number);
        if (!lumi_api_event_id_parse(again, &epoch, &number))
            abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char text[1024];

    if (!size)
        return 0;
    if (data[0] % 6 == 0 && data[0] < 128) {
        read_body((const char *)data + 1, size - 1);
        read_numbers((const char *)data + 1, size - 1);
        return 0;
    }
    if (size > sizeof text) /* a header is at most that long here */
        return 0;
    memcpy(text, data + 1, size - 1);
    text[size - 1] = '\0';
    if (data[0] >= 128) {
        read_query(text);
        read_path(text);
        return 0;
    }
    read_headers(data[0] % 6, text);
    return 0;
}
