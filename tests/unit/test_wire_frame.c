/* proto/wire: frames go through any stream of bytes; what was damaged is dropped, and no more than that. */
#include "proto/base/bytes.h"
#include "proto/wire/frame.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint64_t seed = 1;

static uint32_t chance(uint32_t below)
{
    seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (uint32_t)((seed >> 33) % below);
}

/* Feeds the bytes; returns how many frames came, the last one in the deframer. */
static int feed(struct lumi_wire_deframer *deframer, const uint8_t *data, size_t size)
{
    int frames = 0;

    for (size_t i = 0; i < size; i++)
        frames += lumi_wire_deframe(deframer, data[i]);
    return frames;
}

static void hold(struct lumi_wire_deframer *deframer, const uint8_t *payload, size_t size)
{
    uint8_t frame[LUMI_WIRE_FRAME_MAX];
    size_t length = lumi_wire_frame(payload, size, frame);

    assert_true(length <= LUMI_WIRE_FRAME_SIZE(size));
    assert_int_equal(frame[0], 0);
    assert_int_equal(frame[length - 1], 0);
    assert_null(memchr(frame + 1, 0, length - 2));
    for (size_t i = 0; i + 1 < length; i++)
        assert_false(lumi_wire_deframe(deframer, frame[i]));
    assert_true(lumi_wire_deframe(deframer, frame[length - 1]));
    assert_int_equal(deframer->size, size);
    assert_memory_equal(deframer->data, payload, size);
}

static void a_payload_of_every_length_comes_back(void **state)
{
    struct lumi_wire_deframer deframer;
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];

    (void)state;
    lumi_wire_deframer_init(&deframer);
    for (size_t size = 0; size <= LUMI_WIRE_PAYLOAD_MAX; size++) {
        memset(payload, 0, sizeof payload); /* all zeros, none, and every mixture */
        hold(&deframer, payload, size);
        memset(payload, 0xa5, sizeof payload);
        hold(&deframer, payload, size);
        for (uint32_t zeros = 1; zeros <= 256; zeros *= 4) {
            for (size_t i = 0; i < size; i++)
                payload[i] = chance(zeros) == 0 ? 0 : (uint8_t)chance(256);
            hold(&deframer, payload, size);
        }
    }
    assert_int_equal(deframer.errors, 0);
    assert_int_equal(deframer.frames, (LUMI_WIRE_PAYLOAD_MAX + 1) * 7);
}

static void a_frame_is_what_the_paper_and_the_checksum_say(void **state)
{
    /* CRC-32C of "123456789" is e3069283 (RFC 3720 has others; this is the check value of the catalogue). */
    static const uint8_t expected[] = {0, 14, '1', '2', '3', '4', '5', '6', '7', '8', '9', 0x83, 0x92, 0x06, 0xe3, 0};
    uint8_t frame[LUMI_WIRE_FRAME_SIZE(9)];

    (void)state;
    assert_int_equal(lumi_wire_frame("123456789", 9, frame), sizeof expected);
    assert_memory_equal(frame, expected, sizeof expected);
}

static void every_flipped_bit_of_a_frame_is_noticed(void **state)
{
    static const uint8_t payload[] = {0x12, 0, 0, 7, 0x55, 0xff, 0, 1, 2, 3, 4, 5};
    struct lumi_wire_deframer deframer;
    uint8_t frame[LUMI_WIRE_FRAME_SIZE(sizeof payload)];
    size_t size = lumi_wire_frame(payload, sizeof payload, frame);

    (void)state;
    lumi_wire_deframer_init(&deframer);
    for (size_t i = 1; i + 1 < size; i++)
        for (int bit = 0; bit < 8; bit++) {
            frame[i] ^= (uint8_t)(1 << bit);
            assert_int_equal(feed(&deframer, frame, size), 0);
            frame[i] ^= (uint8_t)(1 << bit);
            assert_int_equal(feed(&deframer, frame, size), 1); /* and the next one is whole */
        }
    assert_int_equal(deframer.frames, (size - 2) * 8);
    assert_true(deframer.errors >= deframer.frames);
}

static void a_frame_that_is_cut_costs_only_itself(void **state)
{
    static const uint8_t payload[] = {1, 2, 3, 0, 5, 6, 7};
    struct lumi_wire_deframer deframer;
    uint8_t frame[LUMI_WIRE_FRAME_SIZE(sizeof payload)];
    size_t size = lumi_wire_frame(payload, sizeof payload, frame);

    (void)state;
    for (size_t cut = 0; cut < size; cut++) {
        lumi_wire_deframer_init(&deframer);
        assert_int_equal(feed(&deframer, frame, cut), 0);
        /* Where only the last delimiter is gone, the next frame's first one serves. */
        assert_int_equal(feed(&deframer, frame, size), cut == size - 1 ? 2 : 1);
        lumi_wire_deframer_init(&deframer);
        /* Begun in the middle, as when a port is opened; then its end is an error, or its whole if only the delimiter
         * before it is gone. */
        assert_int_equal(feed(&deframer, frame + cut, size - cut), cut <= 1);
        assert_int_equal(feed(&deframer, frame, size), 1);
    }
}

static void a_frame_that_is_too_long_is_dropped(void **state)
{
    struct lumi_wire_deframer deframer;
    uint8_t frame[LUMI_WIRE_FRAME_SIZE(4)];
    size_t size = lumi_wire_frame("abcd", 4, frame);

    (void)state;
    lumi_wire_deframer_init(&deframer);
    assert_false(lumi_wire_deframe(&deframer, 0));
    for (int i = 0; i < 100000; i++)
        assert_false(lumi_wire_deframe(&deframer, 0xff));
    assert_int_equal(feed(&deframer, frame, size), 1);
    assert_int_equal(deframer.errors, 1);
    assert_int_equal(deframer.frames, 1);
}

static void zeros_and_noise_between_frames_are_no_frames(void **state)
{
    struct lumi_wire_deframer deframer;
    uint8_t payload[64], frame[LUMI_WIRE_FRAME_SIZE(sizeof payload)];

    (void)state;
    lumi_wire_deframer_init(&deframer);
    for (int i = 0; i < 1000; i++)
        assert_false(lumi_wire_deframe(&deframer, 0));
    assert_int_equal(deframer.errors, 0);
    for (int i = 0; i < 20000; i++) {
        for (uint32_t k = chance(40); k > 0; k--)
            assert_false(lumi_wire_deframe(&deframer, (uint8_t)chance(256)));
        for (size_t k = 0; k < sizeof payload; k++)
            payload[k] = (uint8_t)chance(4);
        assert_int_equal(feed(&deframer, frame, lumi_wire_frame(payload, sizeof payload, frame)), 1);
        assert_int_equal(deframer.size, sizeof payload);
        assert_memory_equal(deframer.data, payload, sizeof payload);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_payload_of_every_length_comes_back),
        cmocka_unit_test(a_frame_is_what_the_paper_and_the_checksum_say),
        cmocka_unit_test(every_flipped_bit_of_a_frame_is_noticed),
        cmocka_unit_test(a_frame_that_is_cut_costs_only_itself),
        cmocka_unit_test(a_frame_that_is_too_long_is_dropped),
        cmocka_unit_test(zeros_and_noise_between_frames_are_no_frames),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
