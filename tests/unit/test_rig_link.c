/* daemon/rig/link: sessions over pseudo-terminals and sockets with a board in another thread. */
#include "daemon/rig/link.h"
#include "fake_board.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "/tmp/lumi-link-XXXXXX";
static char socket_path[64];
static struct fake_board board;

#define EVENTS 200

static const lumi_wire_Request get_status = {.which_command = lumi_wire_Request_get_status_tag};

static void answer_status(struct fake_board *self, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    if (request->which_command == lumi_wire_Request_get_status_tag) {
        reply->which_payload = lumi_wire_Reply_status_tag;
        reply->payload.status = self->status;
    } else if (request->which_command == lumi_wire_Request_pause_tag) {
        reply->result = lumi_wire_Result_REFUSED;
        snprintf(reply->text, sizeof reply->text, "nothing runs");
    } else if (request->which_command == lumi_wire_Request_jog_tag) {
        reply->result = lumi_wire_Result_BAD;
    }
}

static void start(const char *kind)
{
    memset(&board, 0, sizeof board);
    board.execute = answer_status;
    board.clock_ahead_ns = 5000000000u;
    board.status.state = lumi_wire_State_IDLE;
    board.status.step = -12345;
    fake_board_start(&board, kind);
}

static struct lumi_rig_link *open_link(double patience)
{
    struct lumi_rig_link_options options;
    struct lumi_rig_link *link;
    struct lumi_error error = {0};

    lumi_rig_link_options_init(&options);
    options.patience = patience;
    assert_int_equal(lumi_rig_link_open(board.address, &options, &link, &error), LUMI_OK);
    return link;
}

static struct lumi_rig_link *open_session(void)
{
    struct lumi_rig_link *link = open_link(2);
    struct lumi_error error = {0};

    if (lumi_rig_link_wait(link, 20, false, &error))
        fail_msg("%s", error.text);
    return link;
}

static int executed(void)
{
    pthread_mutex_lock(&board.lock);
    int count = board.executed;
    pthread_mutex_unlock(&board.lock);
    return count;
}

static void set_mute(bool mute)
{
    pthread_mutex_lock(&board.lock);
    board.mute = mute;
    pthread_mutex_unlock(&board.lock);
}

/* Waits for a notice of a kind, dropping others. */
static struct lumi_rig_notice expect(struct lumi_rig_link *link, enum lumi_rig_notice_kind kind)
{
    struct lumi_rig_notice notice;

    do
        assert_true(lumi_rig_link_notice(link, 20, &notice));
    while (notice.kind != kind);
    return notice;
}

static void requests_are_answered_over_a_terminal(void **state)
{
    struct lumi_error error = {0};
    lumi_wire_Reply reply;

    (void)state;
    start("pty");
    struct lumi_rig_link *link = open_session();
    for (int i = 0; i < 200; i++) {
        assert_int_equal(lumi_rig_link_request(link, &get_status, 20, &reply, &error), LUMI_OK);
        assert_int_equal(reply.payload.status.step, -12345);
    }
    assert_int_equal(executed(), 200);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void what_the_board_refuses_comes_with_its_words(void **state)
{
    lumi_wire_Request pause = {.which_command = lumi_wire_Request_pause_tag};
    lumi_wire_Request jog = {.which_command = lumi_wire_Request_jog_tag};
    struct lumi_error error = {0};

    (void)state;
    start("pty");
    struct lumi_rig_link *link = open_session();
    assert_int_equal(lumi_rig_link_command(link, &pause, 20, NULL, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "nothing runs"));
    assert_int_equal(lumi_rig_link_command(link, &jog, 20, NULL, &error), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_rig_link_command(link, &get_status, 20, NULL, &error), LUMI_OK);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

struct request_thread {
    struct lumi_rig_link *link;
    int code;
    lumi_wire_Reply reply;
    struct lumi_error error;
};

static void *request_once(void *context)
{
    struct request_thread *self = context;

    self->code = lumi_rig_link_request(self->link, &get_status, 30, &self->reply, &self->error);
    return NULL;
}

static void a_request_in_flight_survives_a_lost_stream_and_is_executed_once(void **state)
{
    struct request_thread thread = {0};
    struct lumi_rig_link_snapshot snapshot;
    pthread_t id;

    (void)state;
    start(socket_path);
    thread.link = open_session();
    set_mute(true);
    pthread_create(&id, NULL, request_once, &thread);
    while (executed() < 1)
        fake_board_nap(1);
    fake_board_hang_up(&board);
    expect(thread.link, LUMI_RIG_NOTICE_DISCONNECTED);
    set_mute(false);
    pthread_join(id, NULL);
    assert_int_equal(thread.code, LUMI_OK);
    assert_int_equal(thread.reply.payload.status.step, -12345);
    assert_int_equal(executed(), 1);
    lumi_rig_link_snapshot(thread.link, &snapshot);
    assert_int_equal(snapshot.state, LUMI_RIG_LINK_OPEN);
    assert_true(snapshot.reconnections >= 1);
    assert_int_equal(snapshot.restarts, 0);
    lumi_rig_link_close(thread.link);
    fake_board_stop(&board);
}

static void a_request_that_a_restart_swallowed_is_reported_lost(void **state)
{
    struct request_thread thread = {0};
    struct lumi_rig_link_snapshot snapshot;
    pthread_t id;

    (void)state;
    start(socket_path);
    thread.link = open_session();
    set_mute(true);
    pthread_create(&id, NULL, request_once, &thread);
    while (executed() < 1)
        fake_board_nap(1);
    fake_board_restart(&board);
    set_mute(false);
    pthread_join(id, NULL);
    assert_int_equal(thread.code, LUMI_ERR_IO);
    assert_non_null(strstr(thread.error.text, "started again"));
    assert_int_equal(executed(), 1);
    while (!expect(thread.link, LUMI_RIG_NOTICE_CONNECTED).restarted)
        ;
    assert_int_equal(lumi_rig_link_request(thread.link, &get_status, 20, &thread.reply, &thread.error), LUMI_OK);
    lumi_rig_link_snapshot(thread.link, &snapshot);
    assert_int_equal(snapshot.requests_lost, 1);
    assert_int_equal(snapshot.restarts, 1);
    lumi_rig_link_close(thread.link);
    fake_board_stop(&board);
}

static void a_silent_board_ends_a_wait_and_what_comes_after_still_works(void **state)
{
    struct lumi_error error = {0};
    lumi_wire_Reply reply;

    (void)state;
    start("pty");
    struct lumi_rig_link *link = open_session();
    set_mute(true);
    assert_int_equal(lumi_rig_link_request(link, &get_status, 0.15, &reply, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "no answer"));
    assert_int_equal(lumi_rig_link_request(link, &get_status, 0.1, &reply, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "this request was not sent")); /* the one before it was */
    set_mute(false);
    assert_int_equal(lumi_rig_link_request(link, &get_status, 20, &reply, &error), LUMI_OK);
    assert_int_equal(executed(), 2);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void a_line_that_another_program_holds_is_refused(void **state)
{
    struct lumi_rig_link *second;
    struct lumi_error error = {0};

    (void)state;
    start("pty");
    struct lumi_rig_link *link = open_session();
    assert_int_equal(lumi_rig_link_open(board.address, NULL, &second, &error), LUMI_OK);
    assert_int_equal(lumi_rig_link_wait(second, 20, true, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "another program"));
    lumi_rig_link_close(second);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void a_line_without_rs485_says_so(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    start("pty");
    strcat(board.address, ",rs485");
    struct lumi_rig_link *link = open_link(2);
    assert_int_equal(lumi_rig_link_wait(link, 20, true, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "has no RS-485"));
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void a_device_that_is_not_ours_is_refused(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    start("pty");
    pthread_mutex_lock(&board.lock);
    board.mute = true;
    board.talk = "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n";
    pthread_mutex_unlock(&board.lock);
    struct lumi_rig_link *link = open_link(0.3);
    assert_int_equal(lumi_rig_link_wait(link, 20, true, &error), LUMI_ERR_UNSUPPORTED);
    assert_non_null(strstr(error.text, "somebody else's"));
    assert_non_null(strstr(error.text, board.address + 7));
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void nobody_at_the_other_end_is_said(void **state)
{
    struct lumi_rig_link *link;
    struct lumi_error error = {0};

    (void)state;
    start("pty");
    set_mute(true);
    link = open_link(0.2);
    assert_int_equal(lumi_rig_link_wait(link, 1, true, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "nothing answers"));
    lumi_rig_link_close(link);
    fake_board_stop(&board);
    assert_int_equal(lumi_rig_link_open("serial:/dev/lumi-no-such-line", NULL, &link, &error), LUMI_OK);
    assert_int_equal(lumi_rig_link_wait(link, 20, true, &error), LUMI_ERR_NOTFOUND);
    lumi_rig_link_close(link);
    assert_int_equal(lumi_rig_link_open("/dev/null", NULL, &link, &error), LUMI_OK);
    assert_int_equal(lumi_rig_link_wait(link, 20, true, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "no serial line"));
    lumi_rig_link_close(link);
}

static void a_board_of_another_version_is_refused_with_both_ranges(void **state)
{
    struct lumi_error error = {0};
    lumi_wire_Reply reply;

    (void)state;
    memset(&board, 0, sizeof board);
    board.identity.version_min = LUMI_WIRE_VERSION_MAX + 1;
    board.identity.version_max = LUMI_WIRE_VERSION_MAX + 3;
    fake_board_start(&board, "pty");
    struct lumi_rig_link *link = open_link(2);
    assert_int_equal(lumi_rig_link_wait(link, 20, true, &error), LUMI_ERR_VERSION);
    assert_non_null(strstr(error.text, "update this program"));
    assert_int_equal(lumi_rig_link_request(link, &get_status, 20, &reply, &error), LUMI_ERR_VERSION);
    assert_int_equal(executed(), 0);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void events_come_once_and_in_order_over_broken_connections(void **state)
{
    uint32_t next = 0;

    (void)state;
    start(socket_path);
    struct lumi_rig_link *link = open_session();
    for (int i = 0; i < EVENTS; i++) {
        lumi_wire_Event event = {.which_kind = lumi_wire_Event_turn_mark_tag};
        event.kind.turn_mark.turn = (uint32_t)i;
        fake_board_event(&board, &event);
        if (i % 50 == 49) {
            fake_board_hang_up(&board);
            fake_board_nap(2);
        }
    }
    while (next < EVENTS) {
        struct lumi_rig_notice notice;
        assert_true(lumi_rig_link_notice(link, 20, &notice));
        assert_int_not_equal(notice.kind, LUMI_RIG_NOTICE_EVENTS_LOST);
        if (notice.kind == LUMI_RIG_NOTICE_EVENT)
            assert_int_equal(notice.event.kind.turn_mark.turn, next++);
    }
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

/* How many events come over a link that holds; the first `stored` are said to be stored. */
static int events_of_one_who_holds(int stored, bool charge)
{
    struct lumi_rig_link_options options;
    struct lumi_rig_link *link;
    struct lumi_rig_notice notice;
    struct lumi_error error = {0};
    int count = 0;

    lumi_rig_link_options_init(&options);
    options.observer = options.holds = true;
    assert_int_equal(lumi_rig_link_open(board.address, &options, &link, &error), LUMI_OK);
    assert_int_equal(lumi_rig_link_wait(link, 20, false, &error), LUMI_OK);
    lumi_rig_link_take_charge(link, charge);
    while (lumi_rig_link_notice(link, charge && count < EVENTS / 2 - stored ? 20 : 0.3, &notice)) {
        if (notice.kind == LUMI_RIG_NOTICE_EVENT && ++count <= stored)
            lumi_rig_link_stored(link, &notice.event);
        if (count == EVENTS / 2 - stored)
            break;
    }
    lumi_rig_link_close(link);
    return count;
}

static void events_stay_on_the_board_until_they_are_stored(void **state)
{
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_turn_mark_tag};

    (void)state;
    start("pty");
    for (int i = 0; i < EVENTS / 2; i++)
        fake_board_event(&board, &event);
    assert_int_equal(events_of_one_who_holds(0, false), 0);
    assert_int_equal(events_of_one_who_holds(0, true), EVENTS / 2);
    assert_int_equal(events_of_one_who_holds(EVENTS / 4, true), EVENTS / 4);
    uint32_t kept = EVENTS / 2;
    for (int i = 0; i < 2000 && kept == EVENTS / 2; i++) { /* the last word may still be on its way */
        fake_board_nap(10);
        pthread_mutex_lock(&board.lock);
        kept = board.server.events.next - board.server.events.first;
        pthread_mutex_unlock(&board.lock);
    }
    assert_int_equal(kept, EVENTS / 4);
    fake_board_stop(&board);
}

static void the_clock_of_the_board_is_matched(void **state)
{
    struct lumi_rig_link_snapshot snapshot;

    (void)state;
    start(socket_path);
    struct lumi_rig_link *link = open_session();
    do {
        fake_board_nap(20);
        lumi_rig_link_snapshot(link, &snapshot);
    } while (!snapshot.clock_matched || !snapshot.status_known);
    int64_t off = snapshot.clock_offset_ns - 5000000000;
    assert_true(llabs((long long)off) <= (long long)(snapshot.round_trip_ns / 2) + 1000);
    assert_int_equal(snapshot.status.state, lumi_wire_State_IDLE);
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_note_tag};
    fake_board_event(&board, &event);
    struct lumi_rig_notice notice = expect(link, LUMI_RIG_NOTICE_EVENT);
    int64_t late = (int64_t)(notice.host_ns + 5000000000 - notice.event.time_ns);
    assert_true(llabs((long long)late) <= (long long)(snapshot.round_trip_ns / 2) + 1000000);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void an_emergency_stop_needs_no_session_and_is_confirmed(void **state)
{
    struct lumi_rig_link_snapshot snapshot;

    (void)state;
    start("pty");
    struct lumi_rig_link *link = open_session();
    assert_true(lumi_rig_link_emergency_stop(link));
    do {
        fake_board_nap(2);
        lumi_rig_link_snapshot(link, &snapshot);
    } while (snapshot.stop_pending);
    pthread_mutex_lock(&board.lock);
    assert_true(board.stops >= 1);
    assert_int_equal(board.executed, 0);
    pthread_mutex_unlock(&board.lock);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void *request_often(void *context)
{
    struct request_thread *self = context;

    for (int i = 0; i < 50 && self->code == LUMI_OK; i++)
        self->code = lumi_rig_link_request(self->link, &get_status, 60, &self->reply, &self->error);
    return NULL;
}

static void many_threads_share_a_link(void **state)
{
    struct request_thread threads[6] = {0};
    pthread_t ids[6];

    (void)state;
    start(socket_path);
    struct lumi_rig_link *link = open_session();
    for (int i = 0; i < 6; i++) {
        threads[i].link = link;
        pthread_create(&ids[i], NULL, request_often, &threads[i]);
    }
    fake_board_hang_up(&board);
    for (int i = 0; i < 6; i++) {
        pthread_join(ids[i], NULL);
        assert_int_equal(threads[i].code, LUMI_OK);
    }
    assert_int_equal(executed(), 300);
    lumi_rig_link_close(link);
    fake_board_stop(&board);
}

static void addresses_that_are_none_are_refused(void **state)
{
    static const char *const addresses[] = {"",
                                            "ttyUSB0",
                                            "serial:",
                                            "serial:/dev/ttyUSB0,baud=17",
                                            "unix:",
                                            "serial:/dev/ttyUSB0,baud=",
                                            "serial:/dev/ttyUSB0,parity=E",
                                            "fd:",
                                            "fd:-1",
                                            "fd:1x"};

    (void)state;
    for (size_t i = 0; i < sizeof addresses / sizeof addresses[0]; i++) {
        struct lumi_rig_link *link;
        struct lumi_error error = {0};
        assert_int_equal(lumi_rig_link_open(addresses[i], NULL, &link, &error), LUMI_ERR_ARG);
        assert_null(link);
    }
    lumi_rig_link_close(NULL);
}

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(socket_path, sizeof socket_path, "%s/board", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(socket_path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(requests_are_answered_over_a_terminal),
        cmocka_unit_test(what_the_board_refuses_comes_with_its_words),
        cmocka_unit_test(a_request_in_flight_survives_a_lost_stream_and_is_executed_once),
        cmocka_unit_test(a_request_that_a_restart_swallowed_is_reported_lost),
        cmocka_unit_test(a_silent_board_ends_a_wait_and_what_comes_after_still_works),
        cmocka_unit_test(a_line_that_another_program_holds_is_refused),
        cmocka_unit_test(a_line_without_rs485_says_so),
        cmocka_unit_test(a_device_that_is_not_ours_is_refused),
        cmocka_unit_test(nobody_at_the_other_end_is_said),
        cmocka_unit_test(a_board_of_another_version_is_refused_with_both_ranges),
        cmocka_unit_test(events_come_once_and_in_order_over_broken_connections),
        cmocka_unit_test(events_stay_on_the_board_until_they_are_stored),
        cmocka_unit_test(the_clock_of_the_board_is_matched),
        cmocka_unit_test(an_emergency_stop_needs_no_session_and_is_confirmed),
        cmocka_unit_test(many_threads_share_a_link),
        cmocka_unit_test(addresses_that_are_none_are_refused),
    };

    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
