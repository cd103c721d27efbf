/* What the doctor's files share. */
#ifndef LUMI_DAEMON_DOCTOR_DOCTOR_PRIV_H
#define LUMI_DAEMON_DOCTOR_DOCTOR_PRIV_H

#include "daemon/doctor/doctor.h"

struct lumi_doctor {
    const struct lumi_doctor_options *options;
    lumi_doctor_fn tell;
    void *context;
    int gige; /* cameras at network addresses that were found */
};

/* `remedy` NULL: nothing is to be done. */
void lumi_doctor_say(struct lumi_doctor *doctor, enum lumi_doctor_verdict verdict, const char *name, const char *remedy,
                     const char *found, ...) __attribute__((format(printf, 5, 6)));
/* (transfer full) */
char *lumi_doctor_path(const struct lumi_doctor *doctor, const char *path);
/* The first number of a file; false where there is none. */
bool lumi_doctor_number(const struct lumi_doctor *doctor, const char *path, double *value);

void lumi_doctor_devices(struct lumi_doctor *doctor); /* doctor_devices.c */
void lumi_doctor_network(struct lumi_doctor *doctor); /* doctor_system.c */
void lumi_doctor_disk(struct lumi_doctor *doctor);
void lumi_doctor_system(struct lumi_doctor *doctor);

#endif
