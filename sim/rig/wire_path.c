/* One direction of a link in virtual time. */
#include "sim/rig/wire_path.h"

#include "firmware/board/board.h"
#include "sim/random.h"

struct packet {
    uint64_t at;
    GBytes *bytes;
};

static void packet_free(gpointer data)
{
    struct packet *packet = data;

    g_bytes_unref(packet->bytes);
    g_free(packet);
}

void sim_wire_path_init(struct sim_wire_path *path, uint64_t seed, double delay_seconds, double bytes_per_second)
{
    *path = (struct sim_wire_path){
        .seed = seed, .delay = (uint64_t)(delay_seconds * BOARD_TICK_HZ), .rate = bytes_per_second};
    g_queue_init(&path->packets);
}

void sim_wire_path_finish(struct sim_wire_path *path)
{
    sim_wire_path_clear(path);
}

void sim_wire_path_clear(struct sim_wire_path *path)
{
    g_queue_clear_full(&path->packets, packet_free);
}

/* Damages `bytes` in one of four ways. */
static void damage(GByteArray *bytes, uint64_t bits)
{
    guint place = (guint)((bits >> 8) % bytes->len);

    switch (bits & 3) {
    case 0:
        bytes->data[place] ^= (guint8)(1u << (bits >> 40 & 7));
        break;
    case 1:
        g_byte_array_remove_index(bytes, place);
        break;
    case 2: {
        guint8 again = bytes->data[place];
        g_byte_array_append(bytes, &again, 1);
        break;
    }
    default:
        g_byte_array_set_size(bytes, 0);
    }
}

void sim_wire_path_send(struct sim_wire_path *path, uint64_t now, const uint8_t *data, size_t size)
{
    uint64_t n = path->sent++;
    GByteArray *bytes;
    struct packet *packet;

    if (path->cut || size == 0)
        return;
    bytes = g_byte_array_new();
    g_byte_array_append(bytes, data, (guint)size);
    if (path->noise > 0 && sim_random_unit(sim_random(path->seed, n, 0)) < path->noise) {
        path->damaged++;
        damage(bytes, sim_random(path->seed, n, 1));
    }
    if (path->free_at < now)
        path->free_at = now;
    path->free_at += (uint64_t)((double)size / path->rate * BOARD_TICK_HZ);
    packet = g_new(struct packet, 1);
    packet->at = path->free_at + path->delay;
    packet->bytes = g_byte_array_free_to_bytes(bytes);
    g_queue_push_tail(&path->packets, packet);
}

uint64_t sim_wire_path_next(const struct sim_wire_path *path)
{
    const struct packet *packet = path->packets.head ? path->packets.head->data : NULL;

    return packet ? packet->at : UINT64_MAX;
}

GBytes *sim_wire_path_take(struct sim_wire_path *path, uint64_t now)
{
    struct packet *packet;
    GBytes *bytes;

    if (sim_wire_path_next(path) > now)
        return NULL;
    packet = g_queue_pop_head(&path->packets);
    bytes = packet->bytes;
    g_free(packet);
    return bytes;
}
