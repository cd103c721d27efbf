/* daemon/access: the file of users, passwords, codes for phones, how often one may try. */
#include "daemon/access/attempts.h"
#include "daemon/access/pairing.h"
#include "daemon/access/qr.h"
#include "daemon/access/secret.h"
#include "daemon/access/users.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <glib.h>

#define SECOND INT64_C(1000000000)

/* Of some password, as yescrypt writes it. */
#define HASH "$y$j9T$xT7Y/2wld9gMtqO.M6zNZ.$2agbDQ117Oq.KjEMw7P/I9P0ppeM1f4xUQktdTop209"

static int parse(const char *text, struct lumi_users *users, struct lumi_error *error)
{
    return lumi_users_parse(text, strlen(text), "users", users, error);
}

static void a_file_says_who_may_do_what(void **state)
{
    struct lumi_users users;
    struct lumi_error error;

    (void)state;
    assert_int_equal(parse("# who\n\nanna:operate:" HASH "\nJürgen:watch:" HASH "\r\n", &users, &error), LUMI_OK);
    assert_int_equal(users.count, 2);
    assert_int_equal(lumi_users_find(&users, "anna")->role, LUMI_ROLE_OPERATE);
    assert_int_equal(lumi_users_find(&users, "Jürgen")->role, LUMI_ROLE_WATCH);
    assert_string_equal(users.user[1].hash, HASH);
    assert_null(lumi_users_find(&users, "ann"));
    assert_int_equal(parse("", &users, &error), LUMI_OK);
    assert_int_equal(users.count, 0);
}

static void what_is_wrong_with_a_file_is_named_by_its_line(void **state)
{
    static const struct {
        const char *text, *part;
    } bad[] = {
        {"anna\n", "users:1: NAME:ROLE:HASH"},
        {"anna:operate\n", "users:1: NAME:ROLE:HASH"},
        {"#\nanna:root:" HASH "\n", "users:2: the role"},
        {"anna:operate:\n", "users:1: no hash"},
        {"anna:operate:secret\n", "users:1: no hash"},
        {"anna:operate:*\n", "users:1: no hash"},
        {"anna:operate:$1$\n", "users:1: no hash"},
        {":operate:" HASH "\n", "users:1: a name"},
        {"an na:operate:" HASH "\n", "users:1: a name"},
        {"an\033[2Jna:operate:" HASH "\n", "users:1: a name"},
        {"\xff:operate:" HASH "\n", "users:1: a name"},
        {"anna:operate:" HASH "\nanna:watch:" HASH "\n", "users:2: anna: there is a user"},
    };
    struct lumi_users users;
    struct lumi_error error;

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(parse(bad[i].text, &users, &error), LUMI_ERR_FORMAT);
        if (strstr(error.text, bad[i].part) != error.text)
            fail_msg("%s: %s", bad[i].text, error.text);
    }
    assert_int_equal(lumi_users_parse("a\0b", 3, "users", &users, &error), LUMI_ERR_FORMAT);
}

static void a_file_that_others_can_read_is_refused(void **state)
{
    char folder[] = "/tmp/lumi-users-XXXXXX", path[64];
    struct lumi_users users = {0}, again;
    struct lumi_user user = {.name = "anna", .role = LUMI_ROLE_WATCH, .hash = HASH};
    struct lumi_error error;
    struct stat is;

    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/users", folder);
    assert_int_equal(lumi_users_load(path, &again, &error), LUMI_OK); /* no file, no users */
    assert_int_equal(again.count, 0);
    assert_int_equal(lumi_users_add(&users, &user, &error), LUMI_OK);
    assert_int_equal(lumi_users_add(&users, &user, &error), LUMI_ERR_EXISTS);
    assert_int_equal(lumi_users_save(path, &users, &error), LUMI_OK);
    assert_int_equal(stat(path, &is), 0);
    assert_int_equal(is.st_mode & 0777, 0600);
    assert_int_equal(lumi_users_load(path, &again, &error), LUMI_OK);
    assert_memory_equal(&users, &again, sizeof users);
    assert_int_equal(chmod(path, 0644), 0);
    assert_int_equal(lumi_users_load(path, &again, &error), LUMI_ERR_UNSUPPORTED);
    assert_non_null(strstr(error.text, "chmod 640"));
    assert_int_equal(lumi_users_remove(&users, "otto", &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(lumi_users_remove(&users, "anna", &error), LUMI_OK);
    assert_int_equal(users.count, 0);
    unlink(path);
    rmdir(folder);
}

static void a_password_is_known_by_its_hash(void **state)
{
    char hash[LUMI_PASSWORD_HASH], other[LUMI_PASSWORD_HASH];
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_password_hash("corréct horse", hash, &error), LUMI_OK);
    assert_int_equal(lumi_password_hash("corréct horse", other, &error), LUMI_OK);
    assert_string_not_equal(hash, other); /* salted */
    assert_true(strncmp(hash, "$y$", 3) == 0 && lumi_password_is_hash(hash));
    assert_true(lumi_password_matches("corréct horse", hash));
    assert_false(lumi_password_matches("correct horse", hash));
    assert_false(lumi_password_matches("", hash));
    assert_false(lumi_password_matches("corréct horse", NULL));
    assert_false(lumi_password_matches("x", "no hash"));
    assert_int_equal(lumi_password_check("1234567", &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_password_check("öäüöäüö", &error), LUMI_ERR_ARG); /* characters, not bytes */
    assert_int_equal(lumi_password_check("12345678", &error), LUMI_OK);
    assert_int_equal(lumi_password_check("1234567\t8", &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_password_check("1234567\xff", &error), LUMI_ERR_ARG);
    memset(hash, 'x', 300);
    hash[300] = '\0';
    assert_int_equal(lumi_password_check(hash, &error), LUMI_ERR_ARG);
}

/* ---- codes ---- */

static void a_code_is_good_once_and_for_five_minutes(void **state)
{
    struct lumi_pairing pairing = {0};
    struct lumi_pairing_offer offer;
    struct lumi_users users = {0};
    char code[LUMI_PAIRING_CODE];

    (void)state;
    strcpy(code, lumi_pairing_make(&pairing, 0, LUMI_ROLE_WATCH, "anna")->code);
    assert_true(strlen(code) == 9 && code[4] == '-');
    assert_false(lumi_pairing_take(&pairing, LUMI_PAIRING_NS, code, &offer));
    assert_false(lumi_pairing_take(&pairing, 0, "", &offer));
    assert_false(lumi_pairing_take(&pairing, 0, "0000-0000", &offer));
    assert_true(lumi_pairing_take(&pairing, LUMI_PAIRING_NS - 1, code, &offer));
    assert_true(offer.role == LUMI_ROLE_WATCH && !strcmp(offer.by, "anna"));
    assert_false(lumi_pairing_take(&pairing, 0, code, &offer));
    for (int i = 0; i < 20; i++)
        strcpy(code, lumi_pairing_make(&pairing, i, LUMI_ROLE_WATCH, "anna")->code);
    assert_int_equal(pairing.count, LUMI_PAIRING_MAX);
    lumi_pairing_sweep(&pairing, 0, &users); /* whoever made them is gone */
    assert_false(lumi_pairing_take(&pairing, 0, code, &offer));
}

/* ---- attempts ---- */

static void each_address_waits_twice_as_long_each_time(void **state)
{
    struct lumi_attempts *attempts = lumi_attempts_create();
    int64_t now = 0, waited = 0;

    (void)state;
    for (int i = 0; i < 5; i++)
        assert_int_equal(lumi_attempts_ask(attempts, now, "\1\2\3\4", 4, false), 0);
    for (int64_t wait = 1; wait <= 512; wait *= 2) {
        assert_int_equal(lumi_attempts_ask(attempts, now, "\1\2\3\4", 4, false), wait * SECOND);
        now += wait * SECOND;
        assert_int_equal(lumi_attempts_ask(attempts, now, "\1\2\3\4", 4, false), 0);
        waited += wait;
    }
    assert_int_equal(lumi_attempts_ask(attempts, now, "\1\2\3\4", 4, false), 900 * SECOND); /* and no longer */
    assert_int_equal(lumi_attempts_ask(attempts, now, "\1\2\3\5", 4, false), 0);            /* another */
    assert_int_equal(lumi_attempts_ask(attempts, now + 3600 * SECOND, "\1\2\3\4", 4, false), 0);
    lumi_attempts_destroy(attempts);
}

static void a_name_of_ones_own_helps_nobody_to_guess_anothers(void **state)
{
    struct lumi_attempts *attempts = lumi_attempts_create();
    int64_t now = 0, wait;
    int guesses = 0;

    (void)state;
    for (int try = 0; try < 400; try++) { /* one's own, and a guess, as fast as may be */
        bool guess = try % 2;
        while ((wait = lumi_attempts_ask(attempts, now, "\1\2\3\4", 4, false)) > 0)
            now += wait;
        guesses += guess;
        if (!guess)
            lumi_attempts_good(attempts, now, "\1\2\3\4", 4, false);
    }
    assert_int_equal(guesses, 200);
    assert_true(now > 180 * 900 * SECOND); /* but for the first each has waited its quarter of an hour */
    lumi_attempts_destroy(attempts);
}

static void strangers_lock_nobody_out_who_was_in_or_sits_here(void **state)
{
    struct lumi_attempts *attempts = lumi_attempts_create();
    unsigned char phone[4] = {192, 168, 1, 9}, stranger[16] = {0x20, 1};
    int let = 0;

    (void)state;
    assert_int_equal(lumi_attempts_ask(attempts, 0, phone, 4, false), 0);
    lumi_attempts_good(attempts, 0, phone, 4, false);
    for (int i = 0; i < 5000; i++) { /* each from an address of its own, within a minute */
        stranger[2] = (unsigned char)i;
        stranger[3] = (unsigned char)(i >> 8);
        let += lumi_attempts_ask(attempts, i * 12 * SECOND / 1000, stranger, 8, false) == 0;
    }
    assert_true(let >= 30 && let <= 62);
    assert_true(lumi_attempts_ask(attempts, 59990 * SECOND / 1000, "\1\1\1\1", 4, false) > 0);
    assert_int_equal(lumi_attempts_ask(attempts, 60 * SECOND, phone, 4, false), 0);
    assert_int_equal(lumi_attempts_ask(attempts, 60 * SECOND, "\177\0\0\1", 4, true), 0);
    for (int i = 0; i < 50; i++)
        lumi_attempts_ask(attempts, 60 * SECOND, "\177\0\0\1", 4, true);
    assert_int_equal(lumi_attempts_ask(attempts, 71 * SECOND, "\177\0\0\1", 4, true), 0); /* ten seconds at most */
    lumi_attempts_destroy(attempts);
}

/* ---- the square ---- */

static void a_square_has_its_margin(void **state)
{
    struct lumi_error error;
    char *text;

    (void)state;
    assert_int_equal(lumi_qr_svg("https://192.168.1.5:8471/#code=ABCD-EFGH", &text, &error), LUMI_OK);
    assert_true(g_str_has_prefix(text, "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 37 37\""));
    assert_non_null(strstr(text, "M4 4h7v1H4z")); /* the finder pattern's edge, four modules in */
    assert_true(g_str_has_suffix(text, "\"/></svg>"));
    g_free(text);
    assert_int_equal(lumi_qr_terminal("x", false, &text, &error), LUMI_OK);
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
    assert_int_equal(g_strv_length(lines), 16); /* 29 rows, two a line, and the end */
    assert_int_equal(g_utf8_strlen(lines[0], -1), 29);
    for (int i = 0; i < 29; i++)
        assert_memory_equal(lines[0] + 3 * i, "█", 3);
    g_free(text);
    g_autofree char *much = g_strnfill(5000, 'x');
    assert_int_equal(lumi_qr_svg(much, &text, &error), LUMI_ERR_LIMIT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_says_who_may_do_what),
        cmocka_unit_test(what_is_wrong_with_a_file_is_named_by_its_line),
        cmocka_unit_test(a_file_that_others_can_read_is_refused),
        cmocka_unit_test(a_password_is_known_by_its_hash),
        cmocka_unit_test(a_code_is_good_once_and_for_five_minutes),
        cmocka_unit_test(each_address_waits_twice_as_long_each_time),
        cmocka_unit_test(a_name_of_ones_own_helps_nobody_to_guess_anothers),
        cmocka_unit_test(strangers_lock_nobody_out_who_was_in_or_sits_here),
        cmocka_unit_test(a_square_has_its_margin),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
