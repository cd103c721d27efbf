/* The ring of events. */
#include "proto/wire/events.h"

#include <assert.h>

#define LENGTH_SIZE 2

void lumi_wire_events_init(struct lumi_wire_events *events)
{
    events->head = events->used = 0;
    events->first = events->next = events->lost = 0;
    events->cursor = events->cursor_at = 0;
}

static uint8_t at(const struct lumi_wire_events *events, uint32_t offset)
{
    return events->bytes[(events->head + offset) % LUMI_WIRE_EVENT_BYTES];
}

static uint32_t record(const struct lumi_wire_events *events, uint32_t offset)
{
    return LENGTH_SIZE + (at(events, offset) | (uint32_t)at(events, offset + 1) << 8);
}

static void drop_oldest(struct lumi_wire_events *events)
{
    uint32_t size = record(events, 0);

    assert(events->first != events->next && size <= events->used);
    if (events->cursor == events->first)
        events->cursor++; /* and stays at the head */
    else
        events->cursor_at -= size;
    events->first++;
    events->head = (events->head + size) % LUMI_WIRE_EVENT_BYTES;
    events->used -= size;
}

static void append(struct lumi_wire_events *events, uint8_t byte)
{
    events->bytes[(events->head + events->used++) % LUMI_WIRE_EVENT_BYTES] = byte;
}

bool lumi_wire_events_add(struct lumi_wire_events *events, lumi_wire_Event *event)
{
    uint8_t data[LUMI_WIRE_EVENT_MAX];

    event->number = events->next;
    event->boot = event->oldest = 0; /* put on where it is sent */
    uint32_t size = (uint32_t)lumi_wire_encode_event(event, data, sizeof data);
    if (size == 0)
        return false;
    while (events->used + LENGTH_SIZE + size > LUMI_WIRE_EVENT_BYTES) {
        drop_oldest(events);
        events->lost++;
    }
    append(events, (uint8_t)size);
    append(events, (uint8_t)(size >> 8));
    for (uint32_t i = 0; i < size; i++)
        append(events, data[i]);
    events->next++;
    return true;
}

bool lumi_wire_events_acknowledge(struct lumi_wire_events *events, uint32_t next)
{
    uint32_t count = next - events->first;

    if (count == 0 || count > events->next - events->first)
        return false;
    while (events->first != next)
        drop_oldest(events);
    return true;
}

size_t lumi_wire_events_peek(const struct lumi_wire_events *events, uint8_t *copy)
{
    if (events->cursor == events->next)
        return 0;
    uint32_t size = record(events, events->cursor_at) - LENGTH_SIZE;
    assert(size <= LUMI_WIRE_EVENT_MAX);
    for (uint32_t i = 0; i < size; i++)
        copy[i] = at(events, events->cursor_at + LENGTH_SIZE + i);
    return size;
}

void lumi_wire_events_advance(struct lumi_wire_events *events)
{
    if (events->cursor == events->next)
        return;
    events->cursor_at += record(events, events->cursor_at);
    events->cursor++;
}

void lumi_wire_events_rewind(struct lumi_wire_events *events)
{
    events->cursor = events->first;
    events->cursor_at = 0;
}
