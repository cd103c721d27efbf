/* proto/wire: events are kept until they are acknowledged, in order; what is pushed out is counted and told. */
#include "wire_bench.h"

static struct lumi_wire_events ring;

static lumi_wire_Event note(int length)
{
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_note_tag};

    memset(event.kind.note.text, 'x', (size_t)length);
    return event;
}

/* The number of the next event that is sent, and moves on. */
static uint32_t take(void)
{
    uint8_t data[5 + LUMI_WIRE_EVENT_MAX] = {0x22};
    size_t size = lumi_wire_events_peek(&ring, data + 3);
    lumi_wire_BoardFrame message;

    assert_true(size > 0);
    data[1] = (uint8_t)(size | 0x80);
    data[2] = (uint8_t)(size >> 7);
    assert_true(lumi_wire_decode_board(data, size + 3, &message));
    lumi_wire_events_advance(&ring);
    return message.body.event.number;
}

static bool none(void)
{
    uint8_t data[LUMI_WIRE_EVENT_MAX];

    return lumi_wire_events_peek(&ring, data) == 0;
}

static void events_are_taken_in_order_and_again_after_a_rewind(void **state)
{
    (void)state;
    lumi_wire_events_init(&ring);
    assert_true(none());
    lumi_wire_events_advance(&ring); /* nothing to advance over */
    for (int i = 0; i < 20; i++) {
        lumi_wire_Event event = note(i);
        assert_true(lumi_wire_events_add(&ring, &event));
        assert_int_equal(event.number, i);
    }
    for (uint32_t i = 0; i < 20; i++)
        assert_int_equal(take(), i);
    assert_true(none());
    assert_true(lumi_wire_events_acknowledge(&ring, 7));
    assert_true(none());
    lumi_wire_events_rewind(&ring);
    for (uint32_t i = 7; i < 20; i++)
        assert_int_equal(take(), i);
    assert_true(lumi_wire_events_acknowledge(&ring, 20));
    assert_int_equal(ring.used, 0);
    assert_int_equal(ring.lost, 0);
}

static void acknowledgements_that_cannot_be_are_ignored(void **state)
{
    (void)state;
    lumi_wire_events_init(&ring);
    for (int i = 0; i < 10; i++) {
        lumi_wire_Event event = note(3);
        lumi_wire_events_add(&ring, &event);
    }
    assert_true(lumi_wire_events_acknowledge(&ring, 4));
    assert_false(lumi_wire_events_acknowledge(&ring, 4));
    assert_false(lumi_wire_events_acknowledge(&ring, 3));
    assert_false(lumi_wire_events_acknowledge(&ring, 11));
    assert_false(lumi_wire_events_acknowledge(&ring, 0x80000004));
    assert_int_equal(ring.first, 4);
    assert_int_equal(take(), 4);
}

/* Against a plain list: any order of adding, taking, acknowledging and rewinding, with numbers that wrap. */
static void a_full_ring_pushes_out_the_oldest_and_counts_them(void **state)
{
    uint64_t seed = 7;
    uint32_t taken = UINT32_MAX - 300, lost = 0;

    (void)state;
    lumi_wire_events_init(&ring);
    ring.first = ring.next = ring.cursor = UINT32_MAX - 300;
    for (int i = 0; i < 200000; i++) {
        seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        uint32_t draw = (uint32_t)(seed >> 33), first = ring.first;

        if (draw % 8 < 4) {
            lumi_wire_Event event = note((int)(draw >> 8) % 64);
            uint32_t used = ring.used, before = ring.lost;
            assert_true(lumi_wire_events_add(&ring, &event));
            lost += ring.first - first;
            assert_int_equal(ring.lost, lost);
            assert_true(ring.lost == before || used > LUMI_WIRE_EVENT_BYTES - LUMI_WIRE_EVENT_MAX - 2);
            if ((int32_t)(ring.first - taken) > 0)
                taken = ring.first;
        } else if (draw % 8 < 7) {
            if (taken == ring.next)
                assert_true(none());
            else
                assert_int_equal(take(), taken++);
        } else if (draw >> 8 & 0xff) {
            lumi_wire_events_rewind(&ring);
            taken = ring.first;
        } else if (ring.first != ring.next) {
            uint32_t next = ring.first + (draw >> 16) % (ring.next - ring.first + 1);
            lumi_wire_events_acknowledge(&ring, next);
            if ((int32_t)(ring.first - taken) > 0)
                taken = ring.first;
        }
        assert_true(ring.used <= LUMI_WIRE_EVENT_BYTES);
    }
    assert_true(lost > 0);
    assert_true(ring.next < UINT32_MAX / 2); /* it has wrapped */
}

static void a_burst_of_events(int count)
{
    for (int i = 0; i < count; i++) {
        lumi_wire_Event event = note(63);
        lumi_wire_server_event(&board.server, &event);
    }
}

static void events_that_were_pushed_out_are_reported_before_the_next(void **state)
{
    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    a_burst_of_events(1000); /* some 170 fit */
    assert_true(board.server.events.lost > 800);
    pair_run(&host, &board, 0, 105 * PAIR_MS, 2000 * PAIR_MS);
    assert_int_equal(host.events_lost, board.server.events.lost);
    assert_int_equal(host.events + (int)host.events_lost, 1000);
    assert_false(host.disorder);
    assert_int_equal(host.pulse.status.events_next, 1000);
    assert_int_equal(host.pulse.status.events_lost, board.server.events.lost);
    assert_int_equal(board.server.events.used, 0);
}

static void an_event_that_is_lost_on_the_line_comes_again_and_those_after_it_wait(void **state)
{
    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    a_burst_of_events(1);
    lumi_wire_server_poll(&board.server, 105 * PAIR_MS);
    pair_lose(&board.out[0]);
    a_burst_of_events(9);
    pair_run(&host, &board, 0, 110 * PAIR_MS, 600 * PAIR_MS);
    assert_int_equal(host.events, 0);
    pair_run(&host, &board, 0, 605 * PAIR_MS, 700 * PAIR_MS);
    assert_int_equal(host.events, 10);
    assert_false(host.disorder);
    assert_int_equal(host.client.gaps, 9);
    assert_int_equal(board.server.events.used, 0);
    assert_int_equal(host.events_lost, 0);
}

static void a_new_host_begins_with_what_is_kept(void **state)
{
    static struct pair_host other;

    (void)state;
    a_burst_of_events(10);
    pair_run(&host, &board, 0, 10 * PAIR_MS, 300 * PAIR_MS);
    assert_int_equal(host.events, 10);
    a_burst_of_events(5); /* nobody hears these */
    pair_host_start(&other, 99);
    pair_run(&other, &board, 0, 5000 * PAIR_MS, 5300 * PAIR_MS);
    assert_int_equal(other.events, 5);
    assert_int_equal(other.events_lost, 0);
    assert_int_equal(other.event.number, 14);
}

static void who_only_looks_takes_no_events_and_keeps_no_sweep_alive(void **state)
{
    static struct pair_host other;
    int heartbeats = board.heartbeats;

    (void)state;
    pair_host_start(&other, 99);
    other.client.observer = true;
    pair_run(&other, &board, 1, 10 * PAIR_MS, 600 * PAIR_MS);
    a_burst_of_events(5);
    pair_run(&other, &board, 1, 610 * PAIR_MS, 1200 * PAIR_MS);
    assert_true(other.pulses >= 2);
    assert_int_equal(other.events, 0);
    assert_int_equal(board.heartbeats, heartbeats);
    pair_run(&host, &board, 0, 1210 * PAIR_MS, 1500 * PAIR_MS);
    assert_int_equal(host.events, 5);
}

static void who_holds_acknowledges_what_is_stored_and_the_next_host_gets_the_rest(void **state)
{
    static struct pair_host next;
    uint32_t boot = host.client.welcome.boot;

    (void)state;
    host.client.holds = true;
    a_burst_of_events(3);
    pair_run(&host, &board, 0, 10 * PAIR_MS, 600 * PAIR_MS); /* heartbeats and all */
    assert_int_equal(host.events, 3);
    assert_false(host.client.acknowledge);
    assert_int_equal(board.server.events.first, 0);
    lumi_wire_client_stored(&host.client, boot + 1, 2, 600 * PAIR_MS); /* of another start */
    assert_false(host.client.acknowledge);
    lumi_wire_client_stored(&host.client, boot, 1, 600 * PAIR_MS);
    lumi_wire_client_stored(&host.client, boot, 0, 600 * PAIR_MS); /* said late: takes nothing back */
    lumi_wire_client_poll(&host.client, 650 * PAIR_MS);
    pair_carry(&host, &board, 0, 650 * PAIR_MS);
    assert_int_equal(board.server.events.first, 2);

    pair_host_start(&next, 0x5678);
    next.client.observer = true;
    lumi_wire_client_poll(&next.client, 700 * PAIR_MS);
    pair_carry(&next, &board, 0, 700 * PAIR_MS);
    assert_int_equal(next.events, 0);
    lumi_wire_client_take_charge(&next.client, true, 701 * PAIR_MS);
    pair_carry(&next, &board, 0, 701 * PAIR_MS);
    assert_int_equal(next.events, 1);
    assert_int_equal(next.event.number, 2);
    assert_int_equal(next.events_lost, 0);
}

static void acknowledgements_are_quiet(void **state)
{
    int pulses;

    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    pulses = host.pulses;
    for (uint64_t i = 0; i < 20; i++) {
        a_burst_of_events(1);
        pair_run(&host, &board, 0, (110 + 50 * i) * PAIR_MS, (155 + 50 * i) * PAIR_MS);
    }
    assert_int_equal(host.events, 20);
    assert_in_range(board.server.events.next - board.server.events.first, 0, 1);
    assert_int_equal(host.pulses, pulses + 2); /* a second has passed */
}

static void answers_go_before_events(void **state)
{
    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    board.out[0].full = true;
    a_burst_of_events(100);
    say_hello(99, 110 * PAIR_MS);
    assert_int_equal(request(&host, 110 * PAIR_MS), LUMI_OK);
    lumi_wire_client_poll(&host.client, 700 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 700 * PAIR_MS);
    pair_lose(&host.out);
    lumi_wire_server_poll(&board.server, 701 * PAIR_MS);
    board.out[0].full = false;
    board.out[0].size = PAIR_QUEUE - 600; /* room for these, not for many events */
    lumi_wire_server_poll(&board.server, 702 * PAIR_MS);
    memset(board.out[0].data, 0, PAIR_QUEUE - 600);
    lumi_wire_client_receive(&host.client, board.out[0].data, board.out[0].size, 703 * PAIR_MS);
    assert_int_equal(host.replies, 1);
    assert_true(host.pulse.received_ns == 700 * PAIR_MS && host.pulse.sent_ns == 702 * PAIR_MS);
    assert_in_range(host.events, 1, 5);
}

static void a_silent_host_is_sent_nothing_more(void **state)
{
    (void)state;
    a_burst_of_events(5);
    lumi_wire_server_poll(&board.server, 1000 * PAIR_MS);
    assert_true(board.out[0].size > 0);
    pair_lose(&board.out[0]);
    lumi_wire_server_poll(&board.server, 1600 * PAIR_MS);
    assert_true(board.out[0].size > 0); /* again */
    pair_lose(&board.out[0]);
    lumi_wire_server_poll(&board.server, 4000 * PAIR_MS);
    assert_int_equal(board.out[0].size, 0);
    assert_int_equal(lumi_wire_server_next_poll(&board.server, 4000 * PAIR_MS), UINT64_MAX);
    pair_run(&host, &board, 0, 5000 * PAIR_MS, 5100 * PAIR_MS);
    assert_int_equal(host.events, 5);
}

static void events_of_an_earlier_boot_are_dropped(void **state)
{
    struct pair_queue old;

    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    a_burst_of_events(3);
    lumi_wire_server_poll(&board.server, 110 * PAIR_MS);
    old = board.out[0];
    pair_board_start(&board, 0xb008);
    lumi_wire_client_reconnected(&host.client, 120 * PAIR_MS);
    pair_run(&host, &board, 0, 120 * PAIR_MS, 200 * PAIR_MS);
    assert_int_equal(host.restarts, 1);
    lumi_wire_client_receive(&host.client, old.data, old.size, 210 * PAIR_MS);
    assert_int_equal(host.events, 0);
    a_burst_of_events(2);
    pair_run(&host, &board, 0, 220 * PAIR_MS, 300 * PAIR_MS);
    assert_int_equal(host.events, 2);
    assert_int_equal(host.event.number, 1);
}

static void the_numbers_of_events_wrap(void **state)
{
    struct lumi_wire_events *events = &board.server.events;

    (void)state;
    events->first = events->next = events->cursor = UINT32_MAX - 5;
    host.client.events_next = host.next_event = UINT32_MAX - 5;
    for (uint64_t i = 0; i < 10; i++) {
        a_burst_of_events(3);
        pair_run(&host, &board, 0, (i + 1) * 100 * PAIR_MS, (i + 1) * 100 * PAIR_MS + 60 * PAIR_MS);
    }
    assert_int_equal(host.events, 30);
    assert_false(host.disorder);
    assert_int_equal(events->first, 24);
    a_burst_of_events(500);
    pair_run(&host, &board, 0, 1200 * PAIR_MS, 2400 * PAIR_MS);
    assert_int_equal(host.events + (int)host.events_lost, 530);
}

static void events_are_lost_across_the_wrap(void **state)
{
    struct lumi_wire_events *events = &board.server.events;

    (void)state;
    events->first = events->next = events->cursor = UINT32_MAX - 50;
    host.client.events_next = host.next_event = UINT32_MAX - 50;
    a_burst_of_events(500);
    assert_true(events->first < 500); /* the oldest is behind the wrap, the one that is wanted before it */
    pair_run(&host, &board, 0, 100 * PAIR_MS, 1200 * PAIR_MS);
    assert_int_equal(host.events + (int)host.events_lost, 500);
    assert_int_equal(host.events_lost, events->lost);
    assert_false(host.disorder);
}

static void a_host_that_moves_to_the_other_link_is_sent_at_once_what_it_lacks(void **state)
{
    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    a_burst_of_events(5);
    lumi_wire_server_poll(&board.server, 105 * PAIR_MS);
    pair_lose(&board.out[0]); /* the cable was pulled */
    lumi_wire_client_reconnected(&host.client, 110 * PAIR_MS);
    pair_run(&host, &board, 1, 110 * PAIR_MS, 120 * PAIR_MS);
    assert_int_equal(host.events, 5);
}

static void an_event_does_not_slip_past_an_answer_that_waits(void **state)
{
    lumi_wire_Event small = {.which_kind = lumi_wire_Event_state_changed_tag};

    (void)state;
    pair_run(&host, &board, 0, 10 * PAIR_MS, 100 * PAIR_MS);
    board.out[0].size = PAIR_QUEUE - 30; /* room for the event, not for a Welcome or a Pulse */
    lumi_wire_server_event(&board.server, &small);
    say_hello(99, 110 * PAIR_MS);
    lumi_wire_client_poll(&host.client, 700 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 700 * PAIR_MS);
    lumi_wire_server_poll(&board.server, 701 * PAIR_MS);
    assert_int_equal(board.out[0].size, PAIR_QUEUE - 30);
    assert_int_equal(lumi_wire_server_next_poll(&board.server, 701 * PAIR_MS), 701 * PAIR_MS);
    pair_lose(&board.out[0]);
    lumi_wire_server_poll(&board.server, 702 * PAIR_MS);
    lumi_wire_client_receive(&host.client, board.out[0].data, board.out[0].size, 703 * PAIR_MS);
    assert_int_equal(host.events, 1);
    assert_int_equal(host.pulse.received_ns, 700 * PAIR_MS);
}

static void an_event_goes_out_with_the_boot_and_the_oldest_that_is_kept(void **state)
{
    lumi_wire_BoardFrame message;

    (void)state;
    a_burst_of_events(300);
    lumi_wire_server_poll(&board.server, 2 * PAIR_MS);
    message = last_sent(0);
    assert_int_equal(message.which_body, lumi_wire_BoardFrame_event_tag);
    assert_int_equal(message.body.event.number, 299);
    assert_int_equal(message.body.event.boot, 0xb007);
    assert_int_equal(message.body.event.oldest, board.server.events.first);
    assert_int_equal(strlen(message.body.event.kind.note.text), 63);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(events_are_taken_in_order_and_again_after_a_rewind),
        cmocka_unit_test(acknowledgements_that_cannot_be_are_ignored),
        cmocka_unit_test(a_full_ring_pushes_out_the_oldest_and_counts_them),
        OPEN(events_that_were_pushed_out_are_reported_before_the_next),
        OPEN(an_event_that_is_lost_on_the_line_comes_again_and_those_after_it_wait),
        OPEN(a_new_host_begins_with_what_is_kept),
        OPEN(who_only_looks_takes_no_events_and_keeps_no_sweep_alive),
        OPEN(who_holds_acknowledges_what_is_stored_and_the_next_host_gets_the_rest),
        OPEN(acknowledgements_are_quiet),
        OPEN(answers_go_before_events),
        OPEN(a_silent_host_is_sent_nothing_more),
        OPEN(events_of_an_earlier_boot_are_dropped),
        OPEN(the_numbers_of_events_wrap),
        OPEN(events_are_lost_across_the_wrap),
        OPEN(a_host_that_moves_to_the_other_link_is_sent_at_once_what_it_lacks),
        OPEN(an_event_does_not_slip_past_an_answer_that_waits),
        OPEN(an_event_goes_out_with_the_boot_and_the_oldest_that_is_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
