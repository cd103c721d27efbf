/* What the board tells, for people (one line) and for programs (one line of JSON). */
#ifndef LUMI_DAEMON_RIG_EVENT_TEXT_H
#define LUMI_DAEMON_RIG_EVENT_TEXT_H

#include "daemon/rig/link.h"

/* Without a line's end. Both are cut where `size` ends; JSON needs at most LUMI_RIG_EVENT_TEXT_MAX. */
#define LUMI_RIG_EVENT_TEXT_MAX 2048
void lumi_rig_notice_text(const struct lumi_rig_notice *notice, char *text, size_t size);
/* `boot`: of the session. `utc_offset_ns`: Unix time less CLOCK_MONOTONIC, for the times that people keep. Host times
 * are left out while the clocks are not matched. `to_host` turns a time of the board into the host's (0: unknown). */
struct lumi_rig_json_clock {
    uint32_t boot;
    int64_t utc_offset_ns;
    uint64_t (*to_host)(void *context, uint64_t board_ns);
    void *context;
};
void lumi_rig_notice_json(const struct lumi_rig_notice *notice, const struct lumi_rig_json_clock *clock, char *text,
                          size_t size);
/* What the state of a finished sweep is called: "complete", "paused" … */
const char *lumi_rig_ended_name(lumi_wire_SweepEnded_How how);

#endif
