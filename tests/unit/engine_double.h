/* Stands in for the capture engine and the hand-over where only the API is tested: says what it was told to say, and
 * remembers what it was asked. */
#ifndef LUMI_TESTS_UNIT_ENGINE_DOUBLE_H
#define LUMI_TESTS_UNIT_ENGINE_DOUBLE_H

#include "daemon/engine/engine.h"
#include "daemon/handover/handover.h"

struct engine_double {
    struct lumi_engine_status status;
    struct lumi_engine_missing missing[4];
    int missing_count;
    struct lumi_process_status processing[2];
    int processing_count;
    struct lumi_ingest_status ingest[2];
    int ingest_count;
    struct lumi_engine_frames frames;
    struct lumi_rig rig;
    const char *rig_source; /* NULL: no rig is known */
    int code;               /* what the next wishes come to */
    char text[256];
    /* asked */
    char call[32], plan[LUMI_PLAN_TEXT_MAX + 1], name[256], title[256], capture[1024], first[256];
    int calls, count;
    double radians;
    bool one_start; /* the second start finds the first one under way */
    bool preflight_only, at_once, seal, again, has_override;
};
extern struct engine_double engine_double;

/* An engine at rest: one camera, one check, nothing captured yet. */
void engine_double_reset(void);
/* Never looked into. */
struct lumi_engine *engine_double_engine(void);
struct lumi_handover *engine_double_handover(void);
struct lumi_ingest *engine_double_ingest(void);

#endif
