/* Is this computer ready for a rig: what was built in, what a user may open, network, disk, memory, clock. Changes
 * nothing, and asks no camera and no board for more than its name. */
#ifndef LUMI_DAEMON_DOCTOR_DOCTOR_H
#define LUMI_DAEMON_DOCTOR_DOCTOR_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stdint.h>

enum lumi_doctor_verdict { LUMI_DOCTOR_GREEN = 0, LUMI_DOCTOR_YELLOW, LUMI_DOCTOR_RED };
const char *lumi_doctor_verdict_name(enum lumi_doctor_verdict verdict);

struct lumi_doctor_finding {
    char name[32]; /* "disk", "network eth0" */
    enum lumi_doctor_verdict verdict;
    char found[512];
    char remedy[512]; /* what to do; "" where there is nothing to be done */
};
typedef void (*lumi_doctor_fn)(void *context, const struct lumi_doctor_finding *finding);

struct lumi_doctor_options {
    const char *root;     /* before /proc, /sys, /dev, /etc, /usr, /lib ("") */
    const char *captures; /* the folder of captures; NULL: as the configuration says, or /var/lib/lumisphere/captures */
    const char *config;   /* of lumid (/etc/lumisphere/lumid.conf) */
    const char *lumid;    /* the program that checks it ("lumid"); NULL: it is not checked */
    bool hardware;        /* looks for cameras and boards (true) */
    bool speed;           /* writes some hundred megabytes to the disk and takes them away */
    int64_t unix_s;       /* now */
    unsigned user;        /* who asks (getuid) */
};
void lumi_doctor_options_init(struct lumi_doctor_options *options);
/* Tells every finding in turn. */
void lumi_doctor_run(const struct lumi_doctor_options *options, lumi_doctor_fn tell, void *context);

#endif
