/* What the Aravis backend reads from the network by itself: pixels as they are packed, answers to a discovery. */
#include "daemon/camera/camera_aravis_priv.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct aravis_pixels pixels_of(const char *name)
{
    struct aravis_pixels pixels;

    assert_true(aravis_pixels_of_name(name, &pixels));
    return pixels;
}

static unsigned sample(const uint8_t *data, int index)
{
    return data[2 * index] | (unsigned)data[2 * index + 1] << 8;
}

static void names_say_filter_depth_and_packing(void **state)
{
    struct aravis_pixels p = pixels_of("BayerGB12Packed");

    (void)state;
    assert_true(p.layout == LUMI_LAYOUT_BAYER && p.bayer == LUMI_BAYER_GBRG);
    assert_true(p.bits == 12 && p.packing == ARAVIS_GVSP);
    p = pixels_of("BayerBG10p");
    assert_true(p.bayer == LUMI_BAYER_BGGR && p.bits == 10 && p.packing == ARAVIS_LSB);
    p = pixels_of("Mono16");
    assert_true(p.layout == LUMI_LAYOUT_GREY && p.bits == 16 && p.packing == ARAVIS_PLAIN);
    p = pixels_of("BGR8");
    assert_true(p.layout == LUMI_LAYOUT_RGB && p.packing == ARAVIS_BGR);
    assert_true(pixels_of("JPEG").layout == LUMI_LAYOUT_JPEG);
}

static void names_of_what_we_cannot_use_are_refused(void **state)
{
    static const char *const wrong[] = {"",         "Bayer",     "BayerRG",         "BayerRG9",
                                        "BayerXX8", "BayerRG8p", "BayerRG16Packed", "Mono8s",
                                        "Mono1p",   "RGB10",     "Coord3D_ABC32f",  "BayerRG12q"};
    struct aravis_pixels pixels;

    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_false(aravis_pixels_of_name(wrong[i], &pixels));
}

/* PFNC 2.1: Mono12p is P0[7:0], P1[3:0] P0[11:8], P1[11:4]; Mono10p carries four in five bytes. */
static void bits_that_are_packed_lowest_first_come_apart(void **state)
{
    const uint8_t twelve[] = {0xbc, 0x3a, 0x12, 0xff, 0x0f}, ten[] = {0x01, 0x08, 0x30, 0x00, 0xff};
    const struct aravis_pixels p12 = pixels_of("Mono12p"), p10 = pixels_of("Mono10p");
    uint8_t to[16];

    (void)state;
    assert_int_equal(aravis_packed_bytes(&p12, 3), 5);
    aravis_unpack(&p12, twelve, 3, to);
    assert_int_equal(sample(to, 0), 0xabc);
    assert_int_equal(sample(to, 1), 0x123);
    assert_int_equal(sample(to, 2), 0xfff);
    assert_int_equal(aravis_packed_bytes(&p10, 4), 5);
    aravis_unpack(&p10, ten, 4, to);
    assert_int_equal(sample(to, 0), 1);
    assert_int_equal(sample(to, 1), 2);
    assert_int_equal(sample(to, 2), 3);
    assert_int_equal(sample(to, 3), 0x3fc);
}

/* GigE Vision: P0[11:4], P1[3:0] P0[3:0], P1[11:4]; with 10 bits 2 low ones each. */
static void gige_s_own_packing_comes_apart(void **state)
{
    const uint8_t twelve[] = {0xab, 0x3c, 0x12, 0xff, 0x0f}, ten[] = {0xff, 0x13, 0x80};
    const struct aravis_pixels p12 = pixels_of("BayerRG12Packed"), p10 = pixels_of("Mono10Packed");
    uint8_t to[16];

    (void)state;
    assert_int_equal(aravis_packed_bytes(&p12, 3), 5);
    aravis_unpack(&p12, twelve, 3, to);
    assert_int_equal(sample(to, 0), 0xabc);
    assert_int_equal(sample(to, 1), 0x123);
    assert_int_equal(sample(to, 2), 0xfff);
    aravis_unpack(&p10, ten, 2, to);
    assert_int_equal(sample(to, 0), 0x3ff);
    assert_int_equal(sample(to, 1), 0x201);
}

static void blue_first_becomes_red_first(void **state)
{
    const uint8_t from[] = {1, 2, 3, 4, 5, 6};
    const struct aravis_pixels p = pixels_of("BGR8");
    uint8_t to[6];

    (void)state;
    aravis_unpack(&p, from, 2, to);
    assert_memory_equal(to, ((uint8_t[]){3, 2, 1, 6, 5, 4}), 6);
}

static void an_answer_to_a_discovery_is_read_and_anything_else_refused(void **state)
{
    uint8_t packet[8 + ARAVIS_DISCOVERY_SIZE] = {0, 0, 0, 3, 0, ARAVIS_DISCOVERY_SIZE, 0x4c, 0x55};
    struct lumi_camera_identity identity;
    uint8_t *data = packet + 8;

    (void)state;
    memcpy(data + 0x24, (uint8_t[]){192, 168, 1, 7}, 4);
    memcpy(data + 0x48, "A maker of cameras with 32 bytes", 32); /* no 0 at its end */
    memcpy(data + 0x68, "M1", 2);
    memcpy(data + 0x0a, (uint8_t[]){2, 0, 0, 0, 0xab, 1}, 6);
    assert_true(aravis_discovery_parse(packet, sizeof packet, &identity));
    assert_string_equal(identity.address, "192.168.1.7");
    assert_string_equal(identity.vendor, "A maker of cameras with 32 bytes");
    assert_string_equal(identity.serial, "02000000ab01"); /* the MAC address stands in */
    memcpy(data + 0xd8, "S 1 \n ", 6);
    assert_true(aravis_discovery_parse(packet, sizeof packet, &identity));
    assert_string_equal(identity.serial, "S 1");
    assert_false(aravis_discovery_parse(packet, sizeof packet - 1, &identity));
    packet[7]++; /* another's question */
    assert_false(aravis_discovery_parse(packet, sizeof packet, &identity));
    packet[7]--;
    packet[0] = 0x80; /* an error */
    assert_false(aravis_discovery_parse(packet, sizeof packet, &identity));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_say_filter_depth_and_packing),
        cmocka_unit_test(names_of_what_we_cannot_use_are_refused),
        cmocka_unit_test(bits_that_are_packed_lowest_first_come_apart),
        cmocka_unit_test(gige_s_own_packing_comes_apart),
        cmocka_unit_test(blue_first_becomes_red_first),
        cmocka_unit_test(an_answer_to_a_discovery_is_read_and_anything_else_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
