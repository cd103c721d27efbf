/* The log of a sweep: a file of JSON lines (docs/rig.md), each appended with one write and on the disk when the
 * function returns. A line that a power cut tore is dropped when the file is opened again. The first line names the
 * plan. */
#ifndef LUMI_DAEMON_RIG_SWEEP_LOG_H
#define LUMI_DAEMON_RIG_SWEEP_LOG_H

#include "daemon/rig/event_text.h"
#include "proto/mechanism/sweep_plan.h"

struct lumi_rig_sweep_log {
    int fd;     /* −1: nothing is kept */
    bool fresh; /* made now, and nothing in it but its first line */
    bool anew;  /* it was there, without a whole first line: begun anew */
    char path[1024];
    /* What it held when it was opened. */
    uint32_t boot, event; /* of the last event in it */
    bool any;
    uint8_t fired[(LUMI_PLAN_SHOTS_MAX + 7) / 8]; /* bit a shot that was fired */
};

/* `path` NULL: nothing is kept. A new one is made (LUMI_ERR_EXISTS where there is one), or with `resume` an old one
 * goes on: LUMI_ERR_FORMAT where it is of another plan, or no such log. An empty one, or one that holds no more than
 * the beginning of the first line (a power cut), is begun anew. */
int lumi_rig_sweep_log_open(struct lumi_rig_sweep_log *log, const char *path, bool resume, const struct lumi_plan *plan,
                            const struct lumi_rig *rig, struct lumi_error *error);
/* A log in which nothing came to stand goes again: its sweep never began. */
int lumi_rig_sweep_log_close(struct lumi_rig_sweep_log *log, struct lumi_error *error);
/* Leaves out what is in it already. */
int lumi_rig_sweep_log_notice(struct lumi_rig_sweep_log *log, const struct lumi_rig_notice *notice,
                              const struct lumi_rig_json_clock *clock, struct lumi_error *error);
/* A shot whose event was lost: the board's map says that it was fired. */
int lumi_rig_sweep_log_shot(struct lumi_rig_sweep_log *log, uint32_t shot, uint32_t boot, struct lumi_error *error);
/* How the clocks stood to one another when the sweep had ended. */
int lumi_rig_sweep_log_clock(struct lumi_rig_sweep_log *log, const struct lumi_rig_link_snapshot *link,
                             struct lumi_error *error);
bool lumi_rig_sweep_log_has(const struct lumi_rig_sweep_log *log, uint32_t shot);

/* One line of a log, for what has to be known of it again; hostile text is fine. */
struct lumi_rig_log_line {
    bool has_boot, has_event, has_shot, lost, has_plan;
    uint32_t boot, event, shot, plan_crc;
};
void lumi_rig_log_line_parse(const char *text, size_t size, struct lumi_rig_log_line *line);

#endif
