/* firmware/core/profile_store: whatever happens to the power, the old or the new profile is found. */
#include "firmware/core/profile_store.h"
#include "flash_model.h"
#include "proto/base/bytes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct flash_model flash;
static struct board board;
static struct profile_store_scratch scratch;
static lumi_wire_Profile message;

/* An encoded bar2 of another name. */
static size_t profile(const char *name, uint8_t data[LUMI_WIRE_PROFILE_MAX])
{
    struct lumi_rig rig;

    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    memset(rig.name, 0, sizeof rig.name);
    snprintf(rig.name, sizeof rig.name, "%s", name);
    size_t size = lumi_wire_encode_profile(&rig, &message, data, LUMI_WIRE_PROFILE_MAX);
    assert_true(size > 0);
    return size;
}

static int save(const char *name)
{
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
    size_t size = profile(name, data);

    return profile_store_save(&board, data, size, false, NULL);
}

/* The name of the profile that is found; "" for none. */
static const char *found(void)
{
    static struct lumi_rig rig;
    struct lumi_error error = {0};
    int code = profile_store_load(&board, &scratch, &rig, NULL, &error);

    if (code != LUMI_OK && code != LUMI_ERR_NOTFOUND)
        fail_msg("%s", error.text);
    return code == LUMI_OK ? rig.name : "";
}

static bool among(const char *name, const char *const *names)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(name, names[i]))
            return true;
    return false;
}

static void what_is_saved_is_loaded(void **state)
{
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
    struct profile_store_copy copy;
    struct lumi_rig rig, wanted;
    size_t size;

    (void)state;
    flash_model_init(&flash, &board, 1);
    assert_string_equal(found(), "");
    for (int i = 0; i < 5; i++) {
        char name[16];
        snprintf(name, sizeof name, "rig%d", i);
        assert_int_equal(save(name), LUMI_OK);
        assert_int_equal(profile_store_load(&board, &scratch, &rig, &copy, NULL), LUMI_OK);
        assert_string_equal(rig.name, name);
        assert_int_equal(copy.slot, i % 2);
        assert_int_equal(copy.sequence, i + 1);
        size = profile(name, data);
        assert_int_equal(copy.size, size);
        assert_int_equal(copy.crc, lumi_crc32c(0, data, size));
        assert_memory_equal(scratch.data, data, size);
    }
    assert_int_equal(lumi_rig_builtin("bar2", &wanted, NULL), LUMI_OK);
    assert_memory_equal(&rig.control.motion, &wanted.control.motion, sizeof wanted.control.motion);
}

static void the_power_may_go_in_every_word_and_in_the_erase(void **state)
{
    static struct flash_model before;
    static const char *const either[] = {"old", "new", NULL};
    int news = 0, olds = 0;

    (void)state;
    for (int full = 0; full < 2; full++) { /* the slot that is written: empty, or with an older profile */
        flash_model_init(&flash, &board, 2 + (uint32_t)full);
        if (full)
            assert_int_equal(save("ancient"), LUMI_OK);
        assert_int_equal(save("old"), LUMI_OK);
        before = flash;
        flash.done = 0;
        assert_int_equal(save("new"), LUMI_OK);
        long steps = flash.done;
        assert_true(steps > 50);
        for (long round = 0; round < steps + 400; round++) {
            /* The first steps (an erase among them) and the last ones (the header) end in more than one way. */
            long cut = round < steps ? round : round % 2 ? round % 5 : steps - 1 - round % 7;
            flash = before;
            flash.seed = (uint32_t)(round * 2 + full) * 2654435761u | 1;
            flash.until_cut = cut;
            assert_true(save("new") != LUMI_OK);
            flash.powered = true;
            for (int boot = 0; boot < 3; boot++) {
                const char *name = found();
                if (!among(name, either))
                    fail_msg("cut %ld of %ld: found '%s'", cut, steps, name);
                news += !strcmp(name, "new");
                olds += !strcmp(name, "old");
            }
            assert_int_equal(save("next"), LUMI_OK);
            assert_string_equal(found(), "next");
        }
    }
    assert_true(olds > 1000 && news > 0); /* new: the last word was cut in, and holds by luck */
}

static void the_power_may_go_again_and_again(void **state)
{
    static const char *const names[] = {"r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", NULL};

    (void)state;
    for (uint32_t seed = 1; seed <= 300; seed++) {
        flash_model_init(&flash, &board, seed);
        assert_int_equal(save("r0"), LUMI_OK);
        flash.done = 0;
        assert_int_equal(save("r1"), LUMI_OK);
        long steps = flash.done;
        const char *possible[3] = {"r1", "r1", NULL}; /* what is there, and what was last tried */
        for (int i = 2; i < 8; i++) {
            /* Rather at the end, where the header is. */
            long back = (long)(flash_model_random(&flash) % 4 ? flash_model_random(&flash) % 9
                                                              : flash_model_random(&flash) % (uint32_t)steps);
            flash.until_cut = steps - back;
            int code = save(names[i]);
            flash.powered = true;
            flash.until_cut = -1;
            const char *name = found();
            if (code == LUMI_OK && strcmp(name, names[i]))
                fail_msg("seed %u: '%s' was saved, '%s' is found", seed, names[i], name);
            if (strcmp(name, names[i]) && !among(name, possible))
                fail_msg("seed %u: '%s' is found after '%s'", seed, name, names[i]);
            if (code == LUMI_OK)
                possible[0] = possible[1] = names[i];
            else {
                possible[0] = among(name, (const char *const[]){names[i], NULL}) ? possible[0] : name;
                possible[1] = names[i];
            }
        }
    }
}

static void damage_of_the_newest_leaves_the_one_before(void **state)
{
    (void)state;
    flash_model_init(&flash, &board, 4);
    assert_int_equal(save("old"), LUMI_OK);
    assert_int_equal(save("new"), LUMI_OK);
    for (int bit = 0; bit < 32 * 40; bit++) {
        if (bit / 32 >= 5 && bit / 32 < 8) /* the header's reserve says nothing */
            continue;
        flash.cells[1][bit / 32] ^= UINT32_C(1) << (bit % 32);
        assert_string_equal(found(), "old");
        flash.cells[1][bit / 32] ^= UINT32_C(1) << (bit % 32);
    }
    assert_string_equal(found(), "new");
    memset(flash.cells, 0, sizeof flash.cells);
    assert_string_equal(found(), "");
}

static void flash_that_refuses_or_forgets_is_noticed(void **state)
{
    (void)state;
    flash_model_init(&flash, &board, 5);
    assert_int_equal(save("old"), LUMI_OK);
    flash.refuses = true;
    assert_int_equal(save("new"), LUMI_ERR_IO);
    flash.refuses = false;
    assert_string_equal(found(), "old");
    flash.worn = 60;
    assert_int_equal(save("new"), LUMI_ERR_IO);
    assert_string_equal(found(), "old");
    flash.worn = -1;
    assert_int_equal(save("new"), LUMI_OK);
    assert_string_equal(found(), "new");
}

/* Puts a copy of other bytes or of another format into slot `slot`, whole. */
static void put(int slot, uint32_t format, uint32_t sequence, const uint8_t *data, size_t size)
{
    uint32_t words[5] = {0x50524c4c, format, sequence, (uint32_t)size, 0};

    words[4] = lumi_crc32c(lumi_crc32c(0, &words[1], 12), data, size);
    memset(flash.cells[slot], 0xff, sizeof flash.cells[slot]);
    memcpy(flash.cells[slot], words, sizeof words);
    memcpy(&flash.cells[slot][8], data, size);
}

static void a_newer_firmware_s_profile_is_neither_used_nor_overwritten(void **state)
{
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
    struct lumi_error error = {0};
    struct lumi_rig rig;
    size_t size = profile("mine", data);

    (void)state;
    flash_model_init(&flash, &board, 6);
    assert_int_equal(save("older"), LUMI_OK);
    put(1, 2, 9, (const uint8_t *)"other bytes.", 12);
    assert_int_equal(profile_store_load(&board, &scratch, &rig, NULL, &error), LUMI_ERR_VERSION);
    assert_non_null(strstr(error.text, "format 2"));
    assert_int_equal(profile_store_save(&board, data, size, false, &error), LUMI_ERR_VERSION);
    assert_int_equal(profile_store_load(&board, &scratch, &rig, NULL, NULL), LUMI_ERR_VERSION);
    assert_int_equal(profile_store_save(&board, data, size, true, &error), LUMI_OK);
    assert_string_equal(found(), "mine");
}

static void a_whole_copy_of_nonsense_is_refused(void **state)
{
    static uint8_t large[BOARD_PROFILE_SLOT_SIZE];
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
    struct lumi_error error = {0};
    struct lumi_rig rig;

    (void)state;
    flash_model_init(&flash, &board, 7);
    put(0, 1, 1, (const uint8_t *)"no profile at all", 17);
    assert_true(profile_store_load(&board, &scratch, &rig, NULL, &error) <= LUMI_ERR_FORMAT);

    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    rig.gear_motor = 0;
    size_t size = lumi_wire_encode_profile(&rig, &message, data, sizeof data);
    put(0, 1, 1, data, size);
    assert_int_equal(profile_store_load(&board, &scratch, &rig, NULL, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "ratio of the drive is zero"));

    put(0, 1, 1, large, BOARD_PROFILE_SLOT_SIZE - 32); /* whole, and bigger than any profile */
    assert_int_equal(profile_store_load(&board, &scratch, &rig, NULL, &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(profile_store_save(&board, large, sizeof large, false, &error), LUMI_ERR_LIMIT);
    assert_int_equal(profile_store_save(&board, large, 0, false, &error), LUMI_ERR_LIMIT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_saved_is_loaded),
        cmocka_unit_test(the_power_may_go_in_every_word_and_in_the_erase),
        cmocka_unit_test(the_power_may_go_again_and_again),
        cmocka_unit_test(damage_of_the_newest_leaves_the_one_before),
        cmocka_unit_test(flash_that_refuses_or_forgets_is_noticed),
        cmocka_unit_test(a_newer_firmware_s_profile_is_neither_used_nor_overwritten),
        cmocka_unit_test(a_whole_copy_of_nonsense_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
