/* What the processes of a simulated rig tell each other, over sequenced-packet sockets between them: they are made by
 * one program and live and die together, so the structure itself goes over. */
#ifndef LUMI_SIM_GIGE_RIG_MESSAGE_H
#define LUMI_SIM_GIGE_RIG_MESSAGE_H

#include "sim/gige/gige.h"

enum rig_message_kind {
    RIG_MESSAGE_CLOCK = 0, /* board to cameras: the shared clock now */
    RIG_MESSAGE_EXPOSED,   /* board to cameras */
    RIG_MESSAGE_PLUG,      /* board to cameras: `on` */
    RIG_MESSAGE_FIRE,      /* cameras to board */
    RIG_MESSAGE_EXPOSURE,  /* cameras to board: `seconds`, as it was set */
    RIG_MESSAGE_DRIVE,     /* board to drive: `on` the enable line; what is wrong with it */
    RIG_MESSAGE_TURNED     /* drive to board: the platform is at `turns`, `on` the position-reached line */
};
struct rig_message {
    enum rig_message_kind kind;
    int camera; /* of the rig */
    bool on;
    double seconds, turns;
    bool alarm, silent;
    uint64_t now_ns;
    struct sim_gige_exposure exposure;
};

#endif
