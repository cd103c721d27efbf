/* A line that loses, doubles, delays (and so reorders), cuts, flips and makes up bytes, by a seed. Both directions of
 * several links are one heap of what is under way. */
#ifndef LUMI_TESTS_UNIT_WIRE_LINE_H
#define LUMI_TESTS_UNIT_WIRE_LINE_H

#include "proto/wire/frame.h"

#include <string.h>

#define LINE_UNDER_WAY 4096

struct line_random {
    uint64_t state;
};

/* Splitmix (Steele, Lea and Flood 2014). */
static inline uint32_t line_draw(struct line_random *random)
{
    uint64_t value = random->state += UINT64_C(0x9e3779b97f4a7c15);

    value = (value ^ value >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    value = (value ^ value >> 27) * UINT64_C(0x94d049bb133111eb);
    return (uint32_t)((value ^ value >> 31) >> 32);
}

static inline uint32_t line_below(struct line_random *random, uint32_t below)
{
    return (uint32_t)((uint64_t)line_draw(random) * below >> 32);
}

static inline bool line_chance(struct line_random *random, uint32_t per_mille)
{
    return line_below(random, 1000) < per_mille;
}

/* What goes wrong, in thousandths of the pieces. */
struct line_faults {
    uint32_t drop, twice, late, cut, flip, noise, full;
    uint64_t delay_ns, late_ns; /* at most */
};

struct line_piece {
    uint64_t at_ns, order;
    int to; /* the caller's number for the far end */
    uint16_t size;
    uint8_t data[LUMI_WIRE_FRAME_MAX + 16];
};

struct line {
    struct line_random random;
    struct line_faults faults;
    bool down; /* nothing gets on it */
    uint64_t pieces, damaged;
    uint64_t order;
    int count;
    struct line_piece *heap[LINE_UNDER_WAY], pool[LINE_UNDER_WAY];
};

static inline void line_init(struct line *line, uint64_t seed, struct line_faults faults)
{
    memset(line, 0, sizeof *line);
    line->random.state = seed;
    line->faults = faults;
    for (int i = 0; i < LINE_UNDER_WAY; i++)
        line->heap[i] = &line->pool[i];
}

static inline bool line_before(const struct line_piece *a, const struct line_piece *b)
{
    return a->at_ns != b->at_ns ? a->at_ns < b->at_ns : a->order < b->order;
}

static inline void line_swap(struct line *line, int a, int b)
{
    struct line_piece *piece = line->heap[a];

    line->heap[a] = line->heap[b];
    line->heap[b] = piece;
}

static inline void line_push(struct line *line, int to, const uint8_t *data, size_t size, uint64_t at_ns)
{
    if (line->count == LINE_UNDER_WAY)
        return; /* lost */
    int i = line->count++;
    struct line_piece *piece = line->heap[i];
    piece->at_ns = at_ns;
    piece->order = line->order++;
    piece->to = to;
    piece->size = (uint16_t)size;
    memcpy(piece->data, data, size);
    for (; i > 0 && line_before(line->heap[i], line->heap[(i - 1) / 2]); i = (i - 1) / 2)
        line_swap(line, i, (i - 1) / 2);
}

/* The next piece, or NULL; it stays the line's and is gone with the next push. */
static inline const struct line_piece *line_pop(struct line *line)
{
    if (line->count == 0)
        return NULL;
    line_swap(line, 0, --line->count);
    for (int i = 0;;) {
        int least = i, left = 2 * i + 1, right = 2 * i + 2;

        if (left < line->count && line_before(line->heap[left], line->heap[least]))
            least = left;
        if (right < line->count && line_before(line->heap[right], line->heap[least]))
            least = right;
        if (least == i)
            break;
        line_swap(line, i, least);
        i = least;
    }
    return line->heap[line->count];
}

/* Puts a piece on the line. False: it takes nothing now. */
static inline bool line_send(struct line *line, int to, const uint8_t *data, size_t size, uint64_t now_ns)
{
    const struct line_faults *faults = &line->faults;
    struct line_random *random = &line->random;
    uint8_t copy[LUMI_WIRE_FRAME_MAX + 16];

    if (line_chance(random, faults->full))
        return false;
    line->pieces++;
    if (line->down || line_chance(random, faults->drop)) {
        line->damaged++;
        return true;
    }
    int times = 1 + line_chance(random, faults->twice);
    for (int i = 0; i < times; i++) {
        uint64_t delay = line_below(random, (uint32_t)(faults->delay_ns / 1000) + 1) * UINT64_C(1000);
        size_t length = size, from = 0;

        memcpy(copy, data, size);
        if (line_chance(random, faults->late))
            delay += line_below(random, (uint32_t)(faults->late_ns / 1000) + 1) * UINT64_C(1000);
        if (line_chance(random, faults->cut)) {
            from = line_below(random, (uint32_t)size);
            length = line_below(random, (uint32_t)(size - from)) + 1;
            line->damaged++;
        }
        if (line_chance(random, faults->flip)) {
            copy[line_below(random, (uint32_t)size)] ^= (uint8_t)(1u << line_below(random, 8));
            line->damaged++;
        }
        if (line_chance(random, faults->noise)) {
            uint32_t extra = line_below(random, 16);

            for (uint32_t k = 0; k < extra && from + length < sizeof copy; k++)
                copy[from + length++] = (uint8_t)line_draw(random);
            line->damaged++;
        }
        line_push(line, to, copy + from, length, now_ns + delay);
    }
    return true;
}

#endif
