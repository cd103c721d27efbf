/* daemon/access: sessions: what they hang on, how long they last, their file; cookies. */
#include "daemon/access/sessions.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <glib.h>

#define SECOND INT64_C(1000000000)
#define IDLE (100 * SECOND)
#define MOST (1000 * SECOND)

static struct lumi_users users;
static struct lumi_sessions *sessions;

static int set_up(void **state)
{
    (void)state;
    memset(&users, 0, sizeof users);
    users.count = 2;
    users.user[0] = (struct lumi_user){.name = "anna", .role = LUMI_ROLE_OPERATE, .hash = "one"};
    users.user[1] = (struct lumi_user){.name = "willi", .role = LUMI_ROLE_WATCH, .hash = "two"};
    sessions = lumi_sessions_create(IDLE, MOST);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    lumi_sessions_destroy(sessions);
    return 0;
}

static void open_for(const char *name, enum lumi_session_via via, const char *by, enum lumi_role role, int64_t now,
                     char secret[LUMI_SECRET_TEXT])
{
    struct lumi_session like = {.role = role, .via = via, .address = "192.168.1.9"};

    strcpy(like.name, name);
    strcpy(like.by, by);
    lumi_sessions_open(sessions, now, &like, &users, secret);
}

static void a_session_is_found_by_its_secret_alone(void **state)
{
    char secret[LUMI_SECRET_TEXT], other[LUMI_SECRET_TEXT];

    (void)state;
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 0, secret);
    const struct lumi_session *found = lumi_sessions_find(sessions, 0, secret);
    assert_non_null(found);
    assert_string_equal(found->name, "anna");
    assert_null(lumi_sessions_find(sessions, 0, found->hash));
    assert_null(lumi_sessions_find(sessions, 0, found->id));
    lumi_secret_make(other);
    assert_null(lumi_sessions_find(sessions, 0, other));
    assert_null(strstr(secret, found->id));
}

static void use_keeps_it_and_nothing_keeps_it_for_ever(void **state)
{
    char secret[LUMI_SECRET_TEXT];

    (void)state;
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 0, secret);
    for (int64_t now = 0; now < MOST; now += IDLE - 1)
        assert_non_null(lumi_sessions_find(sessions, now, secret));
    assert_null(lumi_sessions_find(sessions, MOST, secret));
    lumi_sessions_sweep(sessions, MOST, &users);
    assert_int_equal(lumi_sessions_count(sessions), 0);
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 0, secret);
    assert_null(lumi_sessions_find(sessions, IDLE, secret));
}

static void it_hangs_on_a_user(void **state)
{
    char own[LUMI_SECRET_TEXT], phone[LUMI_SECRET_TEXT], here[LUMI_SECRET_TEXT];

    (void)state;
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 0, own);
    open_for("phone-1", LUMI_VIA_PAIR, "anna", LUMI_ROLE_OPERATE, 0, phone);
    open_for("phone-2", LUMI_VIA_PAIR, "", LUMI_ROLE_WATCH, 0, here);
    lumi_sessions_sweep(sessions, 1, &users);
    assert_int_equal(lumi_sessions_count(sessions), 3);
    users.user[0].role = LUMI_ROLE_WATCH; /* what she may not any more, what she let in may not */
    lumi_sessions_sweep(sessions, 1, &users);
    assert_int_equal(lumi_sessions_find(sessions, 1, own)->role, LUMI_ROLE_WATCH);
    assert_int_equal(lumi_sessions_find(sessions, 1, phone)->role, LUMI_ROLE_WATCH);
    strcpy(users.user[0].hash, "another");
    lumi_sessions_sweep(sessions, 1, &users);
    assert_null(lumi_sessions_find(sessions, 1, own));
    assert_null(lumi_sessions_find(sessions, 1, phone));
    assert_non_null(lumi_sessions_find(sessions, 1, here));
    users.count = 0;
    lumi_sessions_sweep(sessions, 1, &users);
    assert_int_equal(lumi_sessions_count(sessions), 0);
}

static void where_there_are_too_many_the_one_longest_unused_ends(void **state)
{
    char first[LUMI_SECRET_TEXT], second[LUMI_SECRET_TEXT], secret[LUMI_SECRET_TEXT];

    (void)state;
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 0, first);
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 1, second);
    assert_non_null(lumi_sessions_find(sessions, 2, first));
    for (int i = 0; i < LUMI_SESSIONS_MAX - 1; i++)
        open_for("willi", LUMI_VIA_PASSWORD, "willi", LUMI_ROLE_WATCH, 3, secret);
    assert_null(lumi_sessions_find(sessions, 4, second));
    assert_non_null(lumi_sessions_find(sessions, 4, first));
}

static void the_file_brings_them_back_and_time_goes_on(void **state)
{
    char anna[LUMI_SECRET_TEXT], phone[LUMI_SECRET_TEXT];
    struct lumi_error error;

    (void)state;
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 5 * SECOND, anna);
    open_for("phone-1", LUMI_VIA_PAIR, "", LUMI_ROLE_WATCH, 5 * SECOND, phone);
    g_autofree char *text = lumi_sessions_print(sessions, 15 * SECOND, 1000000);
    assert_null(strstr(text, anna));
    lumi_sessions_destroy(sessions);
    sessions = lumi_sessions_create(IDLE, MOST);
    /* Another clock, 89 s later: it was idle for 99. */
    assert_int_equal(lumi_sessions_parse(sessions, text, strlen(text), 7 * SECOND, 1000089, &error), LUMI_OK);
    assert_int_equal(lumi_sessions_count(sessions), 2);
    lumi_sessions_sweep(sessions, 7 * SECOND, &users);
    assert_null(lumi_sessions_find(sessions, 8 * SECOND, phone));
    const struct lumi_session *found = lumi_sessions_find(sessions, 7 * SECOND, anna);
    assert_non_null(found);
    assert_true(!strcmp(found->name, "anna") && !strcmp(found->by, "anna") && found->role == LUMI_ROLE_OPERATE &&
                !strcmp(found->address, "192.168.1.9") && found->via == LUMI_VIA_PASSWORD);
    char id[LUMI_SESSION_ID];
    strcpy(id, found->id);
    strcpy(users.user[0].hash, "changed while lumid was away");
    lumi_sessions_sweep(sessions, 7 * SECOND, &users);
    assert_null(lumi_sessions_by_id(sessions, id));
}

static void a_file_that_is_none_changes_nothing(void **state)
{
    static const char *const bad[] = {"",
                                      "lumid-sessions 2 5\n",
                                      "lumid-sessions 1 \n",
                                      "lumid-sessions 1 5\nx\n",
                                      "lumid-sessions 1 99999999999999999999\n",
                                      "lumid-sessions 1 5\n00 - operate password 1 1 - anna :anna\n"};
    char secret[LUMI_SECRET_TEXT];
    struct lumi_error error;

    (void)state;
    open_for("anna", LUMI_VIA_PASSWORD, "anna", LUMI_ROLE_OPERATE, 0, secret);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(lumi_sessions_parse(sessions, bad[i], strlen(bad[i]), 0, 0, &error), LUMI_ERR_FORMAT);
        assert_non_null(lumi_sessions_find(sessions, 0, secret));
    }
}

static void a_cookie_is_taken_from_its_header(void **state)
{
#define SECRET "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
    static const struct {
        const char *header;
        bool found;
    } cases[] = {
        {"lumid=" SECRET, true},
        {"a=b; lumid=" SECRET "; c=d", true},
        {"lumid=short; lumid=" SECRET, true},
        {" \t;lumid=" SECRET " ", true},
        {"xlumid=" SECRET, false},
        {"lumid =" SECRET, false},
        {"lumid=" SECRET "0", false},
        {"lumid=\"" SECRET "\"", false},
        {"LUMID=" SECRET, false},
        {"lumid", false},
        {"", false},
        {";;;", false},
        {"a=lumid=" SECRET, false},
    };
    char secret[LUMI_SECRET_TEXT], csrf[LUMI_SECRET_TEXT];

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        if (lumi_session_cookie(cases[i].header, "lumid", secret) != cases[i].found)
            fail_msg("%s", cases[i].header);
        if (cases[i].found)
            assert_string_equal(secret, SECRET);
    }
    lumi_session_csrf(SECRET, csrf);
    assert_string_not_equal(csrf, SECRET);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(a_session_is_found_by_its_secret_alone),
        CASE(use_keeps_it_and_nothing_keeps_it_for_ever),
        CASE(it_hangs_on_a_user),
        CASE(where_there_are_too_many_the_one_longest_unused_ends),
        CASE(the_file_brings_them_back_and_time_goes_on),
        CASE(a_file_that_is_none_changes_nothing),
        CASE(a_cookie_is_taken_from_its_header),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
