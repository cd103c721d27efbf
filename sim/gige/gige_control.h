/* A simulated camera's end of GVCP, the control protocol of GigE Vision: a request in, an answer out. Knows no socket
 * and no clock. */
#ifndef LUMI_SIM_GIGE_GIGE_CONTROL_H
#define LUMI_SIM_GIGE_GIGE_CONTROL_H

#include "sim/gige/gige_registers.h"

#define GIGE_PORT 3956
#define GIGE_PACKET_MAX 576 /* of GVCP, with IP and UDP: none may be fragmented */

struct gige_peer {
    uint32_t address; /* host order */
    uint16_t port;
};

/* What a request makes the camera do, beside answering. In the order they came, by bits. */
enum {
    GIGE_DO_START = 1,
    GIGE_DO_STOP = 2,
    GIGE_DO_TRIGGER = 4, /* by software */
    GIGE_DO_ACTION = 8,
    GIGE_DO_TEST_PACKET = 16,
    GIGE_DO_RESEND = 32,
    GIGE_DO_LATCH = 64,    /* the timestamp: the caller fills it in before the answer is of use */
    GIGE_DO_EXPOSURE = 128 /* the exposure time has changed */
};
struct gige_control {
    struct gige_registers registers;
    struct gige_peer controller; /* port 0: none */
    uint64_t heard_ns;           /* when the controller was heard last */
    unsigned actions;            /* what the last request has to be followed by */
    uint16_t resend_block;
    uint32_t resend_first, resend_last;
};

/* At most GIGE_PACKET_MAX bytes of answer; returns its length, 0: none. */
size_t gige_control_answer(struct gige_control *control, const struct gige_peer *peer, uint64_t now_ns,
                           const uint8_t *request, size_t size, uint8_t *answer);
/* Lets the controller go that has not been heard for as long as it said; true: just now. */
bool gige_control_expire(struct gige_control *control, uint64_t now_ns);

#endif
