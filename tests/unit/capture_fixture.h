/* What tests of the capture store share: a scratch folder and captures with a few small frames. */
#ifndef LUMI_TESTS_UNIT_CAPTURE_FIXTURE_H
#define LUMI_TESTS_UNIT_CAPTURE_FIXTURE_H

#include "proto/capture/capture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define PATH_SIZE 512

/* Fails the test with the error's text. */
#define OK(call)                                                                                                       \
    do {                                                                                                               \
        struct lumi_error error_ = {0};                                                                                \
        struct lumi_error *error = &error_;                                                                            \
        if ((call) != LUMI_OK)                                                                                         \
            fail_msg("%s: %s", #call, error->text);                                                                    \
    } while (0)

/* Expects a code and a part of the text. */
#define FAILS(call, wanted, part)                                                                                      \
    do {                                                                                                               \
        struct lumi_error error_ = {0};                                                                                \
        struct lumi_error *error = &error_;                                                                            \
        int code_ = (call);                                                                                            \
        if (code_ != (wanted) || !strstr(error->text, part))                                                           \
            fail_msg("%s: code %d, text '%s'", #call, code_, error->text);                                             \
    } while (0)

/* Runs a shell command that must succeed. */
__attribute__((format(printf, 1, 2))) static inline void shell(const char *format, ...)
{
    char command[4 * PATH_SIZE];
    va_list args;

    va_start(args, format);
    vsnprintf(command, sizeof command, format, args);
    va_end(args);
    assert_int_equal(system(command), 0);
}

static inline int scratch_setup(void **state)
{
    char *folder = malloc(PATH_SIZE);
    const char *base = getenv("TMPDIR");

    snprintf(folder, PATH_SIZE, "%s/lumi-capture-XXXXXX", base ? base : "/tmp");
    *state = folder;
    return mkdtemp(folder) ? 0 : -1;
}

static inline int scratch_teardown(void **state)
{
    shell("chmod -R u+w '%s' && rm -rf '%s'", (char *)*state, (char *)*state);
    free(*state);
    return 0;
}

/* A path in the scratch folder; stays valid for the program's life. */
static inline const char *in_scratch(void **state, const char *name)
{
    static char paths[128][PATH_SIZE];
    static int count;
    char path[PATH_SIZE];

    snprintf(path, PATH_SIZE, "%.400s/%.100s", (char *)*state, name);
    for (int i = 0; i < count; i++)
        if (!strcmp(paths[i], path))
            return paths[i];
    assert_in_range(count, 0, 127);
    memcpy(paths[count], path, PATH_SIZE);
    return paths[count++];
}

static inline struct lumi_capture_lens small_lens(void)
{
    struct lumi_capture_lens lens = {.name = "small", .model = "SIMPLE_RADIAL", .parameter_count = 4};

    lumi_lens_init_pinhole(&lens.lens, 16, 12, 1);
    lens.lens.k1 = -0.1;
    lens.parameters[0] = lens.lens.fx;
    lens.parameters[1] = 8;
    lens.parameters[2] = 6;
    lens.parameters[3] = -0.1;
    return lens;
}

static inline int64_t add_camera(struct lumi_capture *capture, const char *name)
{
    struct lumi_capture_lens lens = small_lens();
    int64_t id = 0, camera = 0;

    OK(lumi_capture_add_lens(capture, &lens, &id, error));
    OK(lumi_capture_add_camera(capture, name, id, &camera, error));
    return camera;
}

static inline int64_t add_frame(struct lumi_capture *capture, int64_t camera, const char *name)
{
    const struct lumi_capture_new_frame frame = {.name = name, .camera = camera, .row = -1, .column = -1};
    int64_t id = 0;

    OK(lumi_capture_add_frame(capture, &frame, &id, error));
    return id;
}

static inline struct lumi_capture_file small_file(void)
{
    const struct lumi_capture_file file = {
        .extension = ".jpg", .width = 16, .height = 12, .camera_time_us = LUMI_NO_TIME};

    return file;
}

/* The bytes that stand for a picture of `seed`: a different length and content for each. */
static inline size_t picture(unsigned seed, unsigned char *bytes, size_t size)
{
    size_t count = 1 + (seed * 2654435761u >> 7) % size;

    for (size_t i = 0; i < count; i++)
        bytes[i] = (unsigned char)(seed * 31 + i * 7 + (i >> 8));
    return count;
}

static inline int64_t store_frame(struct lumi_capture *capture, int64_t camera, const char *name, unsigned seed)
{
    struct lumi_capture_file file = small_file();
    unsigned char bytes[3000];
    size_t count = picture(seed, bytes, sizeof bytes);
    int64_t id = add_frame(capture, camera, name);

    OK(lumi_capture_store_bytes(capture, id, bytes, count, &file, error));
    return id;
}

static inline void print_problem(void *context, const char *file, const char *text)
{
    (void)context;
    fprintf(stderr, "%s: %s\n", file, text);
}

static inline int problems_of(const char *path)
{
    struct lumi_verify_result result;

    OK(lumi_capture_verify(path, print_problem, NULL, NULL, &result, error));
    return result.problems;
}

#endif
