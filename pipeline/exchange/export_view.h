/* One view of a light field or of a capture in work, for other programs. */
#ifndef LUMI_PIPELINE_EXCHANGE_EXPORT_VIEW_H
#define LUMI_PIPELINE_EXCHANGE_EXPORT_VIEW_H

#include "proto/base/result.h"

struct lumi_export_view {
    const char *source; /* a .lumi file, or a capture with its work directory beside it */
    const char *work;   /* that directory; NULL: "<capture>.work" */
    const char *view;   /* name, or number from 0 */
    const char *depth;  /* OpenEXR file to write; NULL: none */
    const char *mesh;   /* PLY file to write; NULL: none */
    double far_m;       /* meshes end there */
};

/* LUMI_ERR_NOTFOUND for a view that is not there, or a capture that has not been processed so far. */
int lumi_export_view(const struct lumi_export_view *export, struct lumi_error *error);

#endif
