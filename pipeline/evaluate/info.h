/* What a capture or a field holds, in numbers: what `lumi info` prints. */
#ifndef LUMI_PIPELINE_EVALUATE_INFO_H
#define LUMI_PIPELINE_EVALUATE_INFO_H

#include "proto/base/result.h"
#include "proto/capture/capture.h"
#include "proto/lightfield/field.h"

#include <stdbool.h>
#include <stdint.h>

/* 24 bits a pixel: what compression factors are counted against. */
#define LUMI_INFO_RAW_BYTES 3

struct lumi_capture_summary {
    struct lumi_capture_info info;
    char title[256], source[256], surface[32], created[64], software[64];
    uint64_t pixels;       /* of all frames that have a file */
    int sizes;             /* how many different image sizes there are */
    int width, height;     /* the most frequent one */
    int in_pose_source[5]; /* frames by enum lumi_pose_source */
    uint64_t total_bytes;  /* of all files of the directory */
    char extensions[64];   /* of the frames' files, "jpg, png" */
};

struct lumi_field_summary {
    struct lumi_field_info info;
    int grids;
    struct {
        int width, height, cols, rows; /* of the first view */
        double fov_x, fov_y;           /* radians, edge to edge */
        int references;
        uint64_t tiles, vertices, triangles;
    } levels[LUMI_LEVELS];
};

struct lumi_info {
    bool is_field; /* a capture otherwise */
    struct lumi_capture_summary capture;
    struct lumi_field_summary field;
};

/* A directory is read as a capture, a file as a field. Every error names `path`. */
int lumi_info_read(const char *path, int threads, struct lumi_info *info, struct lumi_error *error);

/* For people, some lines; for programs, one JSON object on one line. (transfer full) */
char *lumi_info_text(const struct lumi_info *info, const char *path);
char *lumi_info_json(const struct lumi_info *info, const char *path);

#endif
