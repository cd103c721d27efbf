/* Within exchange: what an import of cameras' own recordings knows while it goes on. */
#ifndef LUMI_PIPELINE_EXCHANGE_INGEST_PRIV_H
#define LUMI_PIPELINE_EXCHANGE_INGEST_PRIV_H

#include "pipeline/exchange/card.h"
#include "pipeline/exchange/recordings.h"
#include "pipeline/exchange/shot_match.h"
#include "proto/capture/capture.h"

#include <glib.h>

/* One camera's picture of one shot. */
struct ingest_frame {
    int file;     /* index among the camera's files or moments; −1: there is none */
    double turns; /* the rig's place when it was taken, turns into the sweep; NaN: the position's */
    char *reason; /* why there is no picture; NULL: nothing more is known; owned */
};

struct ingest_camera {
    char *path; /* NULL: none was given; owned */
    bool video;
    bool taking_part;
    struct lumi_card card; /* files NULL where there is no folder */
    struct lumi_shot_camera match;
    struct lumi_lens lens; /* the profile's, at the pictures' size */
    int64_t id;
    struct ingest_frame *frames; /* one a shot */
    struct ingest_film *film;    /* of a video */
};

struct ingest {
    const struct lumi_ingest_options *options;
    struct lumi_rig rig; /* with the plan's positions: for rows and columns */
    struct lumi_plan plan;
    int camera_count;
    struct ingest_camera cameras[LUMI_RIG_CAMERAS];
    struct lumi_shot_plan shots;
    int64_t begin_us; /* what times of items are counted from; LUMI_NO_TIME */
    double white[3];  /* of raw files; green 0: there are none */
    GArray *findings; /* struct ingest_finding */
    bool videos;
    const char *what; /* "cards", "videos" */
    /* Stores the picture of a camera's shot in its frame. */
    int (*store)(struct ingest *ingest, struct lumi_capture *capture, int camera, int shot, int64_t frame,
                 struct lumi_error *error);
};

struct ingest_finding {
    char kind[32];
    int camera; /* −1: none */
    int64_t time_us;
    char *text; /* owned */
};

/* A line for the report and the capture's incidents. */
void ingest_find(struct ingest *ingest, const char *kind, int camera, int64_t time_us, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* "shot 17 (turn 0, position 16)", "turn 0, position 16, exposure 2 of 3"; g_free. */
char *ingest_shot_name(const struct ingest *ingest, int shot);
/* Shots without picture, as findings: runs of a camera's, and such that no camera has. */
void ingest_find_missing(struct ingest *ingest);

/* The profile's lens at the size of the camera's pictures. LUMI_ERR_FORMAT: another shape than the profile's. */
int ingest_fit_lens(struct ingest *ingest, int camera, int width, int height, const char *file,
                    struct lumi_error *error);

/* Cards: read, matched, findings made. */
int ingest_cards(struct ingest *ingest, struct lumi_error *error);

/* Room for a frame a shot, none with a picture. */
void ingest_make_frames(struct ingest *ingest, int camera);

/* One white balance for all raw files among the chosen ones. */
int ingest_find_white(struct ingest *ingest, struct lumi_error *error);

/* All rows and files of the capture. */
int ingest_write(struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error);

#endif
