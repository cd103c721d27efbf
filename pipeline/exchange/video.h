/* WebM files: pictures, one after another, coded with VP9. */
#ifndef LUMI_PIPELINE_EXCHANGE_VIDEO_H
#define LUMI_PIPELINE_EXCHANGE_VIDEO_H

#include "proto/base/raster.h"
#include "proto/base/result.h"

struct lumi_video;

/* Begins `path` under a temporary name. `quality` 0..63 as libvpx counts it, lower is better. The bytes depend on the
 * pictures and these numbers alone. */
int lumi_video_create(const char *path, int width, int height, int frames_per_second, int quality,
                      struct lumi_video **video, struct lumi_error *error);
/* The next picture: RGB, of the video's size, any sample type. */
int lumi_video_add(struct lumi_video *video, const struct lumi_raster *picture, struct lumi_error *error);
/* Writes what is left and gives the file its name; the video is released, whatever comes of it. */
int lumi_video_finish(struct lumi_video *video, struct lumi_error *error);
/* Releases a video and leaves no file; accepts NULL. */
void lumi_video_abandon(struct lumi_video *video);

#endif
