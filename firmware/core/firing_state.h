/* What firing.c remembers. Only for firmware/core. */
#ifndef LUMI_FIRMWARE_CORE_FIRING_STATE_H
#define LUMI_FIRMWARE_CORE_FIRING_STATE_H

#include "firmware/core/firing.h"

#define FIRING_EDGES 160 /* queued at once: three shots of 16 cameras whose three edges all differ, more where not */
#define FIRING_SLOTS 6   /* shots queued or under way at once */
#define FIRING_NO_SLOT 0xff
#define FIRING_STAMPS 32 /* feedback edges between two polls, a power of two */

struct firing_edge {
    uint64_t at;
    uint16_t rise, fall; /* lines */
    uint8_t slot;        /* whose, or FIRING_NO_SLOT */
};

enum firing_gate { GATE_OPEN = 0, GATE_FINISH, GATE_OFF }; /* no new shots; no new edge of any kind */
enum firing_slot_use { SLOT_FREE = 0, SLOT_QUEUED, SLOT_BEGUN, SLOT_BROKEN };

struct firing_slot {
    enum firing_slot_use use; /* BEGUN: from its first edge on. BROKEN: stopped under way */
    uint32_t number;
    uint8_t exposure;
    bool late;
    uint8_t edges_left;
    uint32_t risen;   /* bit a camera */
    uint64_t middle;  /* tick */
    uint64_t end;     /* of its last exposure, or its last line's fall if that is later */
    int64_t edge[16]; /* ticks from middle to the risen edge, by camera */
    double position;
};

/* One camera that takes part, in ticks. */
struct firing_camera {
    uint8_t camera;
    int8_t channel, focus_channel, feedback;
    uint32_t lag, pulse, focus_lead; /* up to 10 s; 32 bits hold 51 */
    uint64_t busy, free_at;          /* free_at: from then on it takes a trigger */
};

struct firing_stamp {
    uint64_t at;
    uint8_t input;
    bool active;
};

struct firing {
    const struct board *board;
    firing_report report;
    firing_report_edge report_edge;
    void *context;
    /* Of the sweep. */
    int camera_count, exposure_count;
    int shot_edges; /* one shot takes at most so many */
    struct firing_camera cameras[LUMI_RIG_CHANNELS];
    uint64_t exposures[LUMI_PLAN_BRACKET];
    uint8_t camera_of_channel[LUMI_RIG_CHANNELS];
    uint32_t fired, lost;
    uint32_t first_planned; /* none before it is */
    uint8_t states[LUMI_PLAN_SHOTS_MAX / 4];
    /* Shared with the interrupt, under lock. A ring of edges in order of time. */
    struct firing_edge *edges; /* FIRING_EDGES, the owner's; not touched while nothing is queued */
    uint16_t edge_first, edge_count;
    uint16_t armed;                   /* edges of the pattern that is pending in the board; 0: none */
    uint8_t holds[LUMI_RIG_CHANNELS]; /* by how many a line is held up */
    uint16_t lines;
    volatile uint32_t stops; /* how often everything was stopped: what was being queued then is given up */
    volatile enum firing_gate gate;
    struct firing_slot slots[FIRING_SLOTS];
    /* Record pulses: told by those that have gone up, for what is queued may be dropped. */
    volatile uint32_t pulses; /* outside any shot, that have gone up */
    uint32_t pulses_before;   /* … when a record pulse was asked for */
    bool record_asked, record_start, recording;
    uint16_t record_lines;
    /* From interrupt to main loop; each writes one of the two counters. */
    struct firing_stamp stamps[FIRING_STAMPS];
    volatile uint32_t stamps_in, stamps_out;
    volatile uint32_t stamps_lost;
    uint32_t last_shot[LUMI_RIG_FEEDBACKS]; /* whose exposure an input's last rising edge was */
};

/* Between firing.c and firing_lines.c. */
#define FIRING_RACE_TICKS (BOARD_TICK_HZ / 20000) /* an edge this near may be out already: 50 µs */
/* Queues an edge; false: stopped since `stops` was read. The caller has seen that there is room. */
bool firing_queue(struct firing *firing, const struct firing_edge *edge, uint32_t stops);
int firing_room(const struct firing *firing);
void firing_finish_shot(struct firing *firing, struct firing_slot *slot);

#endif
