/* What the cameras of a rig recorded by themselves, one folder (or memory card) or one video a camera, becomes a
 * capture with the poses that the rig's mechanism tells. What is missing, too much or damaged is found, said in a line
 * each and kept in the capture as incidents; the rest is imported. docs/import-export.md, "Cameras that record by
 * themselves". */
#ifndef LUMI_PIPELINE_EXCHANGE_RECORDINGS_H
#define LUMI_PIPELINE_EXCHANGE_RECORDINGS_H

#include "proto/base/result.h"
#include "proto/mechanism/sweep_plan.h"

#include <stdbool.h>

struct lumi_ingest_source {
    const char *camera; /* the profile's name */
    const char *path;   /* its folder or video */
};

/* The one white balance with which all raw files of the capture are developed: the median of what the files say, that
 * of daylight, that by which pictures all around are grey on the whole, or given. */
enum lumi_ingest_white {
    LUMI_INGEST_WHITE_CAMERA = 0,
    LUMI_INGEST_WHITE_DAYLIGHT,
    LUMI_INGEST_WHITE_AUTO,
    LUMI_INGEST_WHITE_GIVEN
};

struct lumi_ingest_options {
    const struct lumi_rig *rig;
    const struct lumi_plan *plan; /* NULL: what the rig is meant for */
    const char *folder;           /* with a sub-folder or video named as each camera; may be NULL */
    const struct lumi_ingest_source *sources;
    int source_count;
    int bracket;                       /* shots a position; 0: found from the exposures */
    double offsets[LUMI_PLAN_BRACKET]; /* in stops, in the order they are taken */
    enum lumi_ingest_white white;
    double white_given[3]; /* factors of red, green, blue */
    double marks[2]; /* videos: when the first turn begins and the last ends, s of the first camera's; equal: by the
                        lamp */
    bool trust;      /* pictures are not decoded to see whether they are whole */
    bool strict;     /* whatever is found fails the import: LUMI_ERR_FORMAT with the first line */
    int threads;
    const char *date;                                          /* YYYY-MM-DD, for the bag; may be NULL */
    void (*found)(const char *line);                           /* each thing that was found, a line; may be NULL */
    void (*progress)(const char *what, long done, long total); /* may be NULL */
};
void lumi_ingest_options_init(struct lumi_ingest_options *options);

/* Makes a capture at `path`. Nothing is left behind on failure. LUMI_ERR_NOTFOUND, LUMI_ERR_FORMAT: no camera has
 * pictures, or none that fits. */
int lumi_ingest(const char *path, const struct lumi_ingest_options *options, struct lumi_error *error);

#endif
