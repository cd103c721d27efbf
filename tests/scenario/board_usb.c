/* The firmware's USB driver, as it is flashed, on the OTG_FS model, spoken to by a host controller packet by packet:
 * enumeration, stalls, packets of no length, suspend, unplugging in the middle of a transfer. */
#include "board_fixture.h"

#include "proto/wire/transport.h"

static void plugged(struct board_fixture *f)
{
    board_fixture_init(f);
    usb_host_plug(f405_machine_usb(f->machine), true);
    assert_int_equal(usb_enumerate(f->machine, 5), USB_DONE);
}

static size_t descriptor(struct board_fixture *f, int type, int index, int language, uint8_t *data, uint16_t size)
{
    size_t length = 0;
    assert_int_equal(
        usb_control(f->machine, 0x80, 6, (uint16_t)(type << 8 | index), (uint16_t)language, data, size, &length),
        USB_DONE);
    return length;
}

static void the_device_tells_what_it_is(void **state)
{
    struct board_fixture f;
    uint8_t data[256];
    (void)state;
    plugged(&f);
    assert_int_equal(descriptor(&f, 1, 0, 0, data, sizeof data), 18);
    assert_int_equal(data[8] | data[9] << 8, LUMI_WIRE_USB_VENDOR);
    assert_int_equal(data[10] | data[11] << 8, LUMI_WIRE_USB_PRODUCT);
    int serial = data[16];
    assert_true((data[2] | data[3] << 8) >= 0x0201); /* it has a BOS */
    size_t length = descriptor(&f, 2, 0, 0, data, sizeof data);
    assert_int_equal(length, data[2] | data[3] << 8);
    assert_int_equal(length, 9 + 9 + 7 + 7);
    assert_int_equal(data[9 + 5], LUMI_WIRE_USB_CLASS);
    assert_int_equal(data[9 + 6], LUMI_WIRE_USB_SUBCLASS);
    assert_int_equal(data[9 + 7], LUMI_WIRE_USB_PROTOCOL);
    /* The first bytes only, as hosts ask for them at first. */
    assert_int_equal(descriptor(&f, 2, 0, 0, data, 9), 9);
    /* Twelve bytes of the chip's unique ID as hexadecimal digits. */
    assert_int_equal(descriptor(&f, 3, serial, 0x409, data, sizeof data), 2 + 2 * 24);
    assert_int_equal(descriptor(&f, 3, 0, 0, data, sizeof data), 4);
    length = descriptor(&f, 15, 0, 0, data, sizeof data);
    assert_int_equal(length, data[2] | data[3] << 8);
    f405_machine_run(f.machine, 0.01);
    board_fixture_finish(&f);
}

static void windows_finds_its_driver_in_the_descriptors(void **state)
{
    static const uint8_t uuid[16] = {0xdf, 0x60, 0xdd, 0xd8, 0x89, 0x45, 0xc7, 0x4c,
                                     0x9c, 0xd2, 0x65, 0x9d, 0x9e, 0x64, 0x8a, 0x9f};
    struct board_fixture f;
    uint8_t bos[256], set[256];
    size_t length = 0;
    (void)state;
    plugged(&f);
    size_t end = descriptor(&f, 15, 0, 0, bos, sizeof bos), at = 5;
    while (at + 28 <= end && !(bos[at + 2] == 5 && memcmp(bos + at + 4, uuid, 16) == 0))
        at += bos[at];
    assert_true(at + 28 <= end);
    /* Microsoft OS 2.0 Descriptors, tables 4 and 9. */
    uint16_t total = (uint16_t)(bos[at + 24] | bos[at + 25] << 8);
    assert_int_equal(usb_control(f.machine, 0xc0, bos[at + 26], 0, 7, set, sizeof set, &length), USB_DONE);
    assert_int_equal(length, total);
    assert_int_equal(set[8] | set[9] << 8, total);
    bool winusb = false;
    for (size_t i = 0; i + 6 <= length; i++)
        winusb = winusb || memcmp(set + i, "WINUSB", 6) == 0;
    assert_true(winusb);
    board_fixture_finish(&f);
}

static void what_the_device_does_not_know_is_stalled_and_nothing_hangs(void **state)
{
    struct board_fixture f;
    uint8_t data[64] = {0};
    size_t length = 0;
    (void)state;
    plugged(&f);
    assert_int_equal(usb_control(f.machine, 0xc0, 0x5a, 0, 0x77, data, 64, NULL), USB_STALLED);
    assert_int_equal(usb_control(f.machine, 0x40, 0x5a, 0, 0, NULL, 0, NULL), USB_STALLED);
    assert_int_equal(usb_control(f.machine, 0x40, 0x5a, 0, 0, data, 64, NULL), USB_STALLED);
    assert_int_equal(usb_control(f.machine, 0x80, 6, 0x0600, 0, data, 10, NULL), USB_STALLED); /* device qualifier */
    assert_int_equal(usb_control(f.machine, 0x80, 6, 0x037f, 0x409, data, 64, NULL), USB_STALLED);
    assert_int_equal(usb_control(f.machine, 0x00, 9, 7, 0, NULL, 0, NULL), USB_STALLED); /* no such configuration */
    assert_int_equal(usb_control(f.machine, 0x80, 0, 0, 0, data, 2, &length), USB_DONE); /* GET_STATUS */
    assert_int_equal(length, 2);
    assert_int_equal(usb_control(f.machine, 0x80, 8, 0, 0, data, 1, NULL), USB_DONE);
    assert_int_equal(data[0], 1);
    board_fixture_finish(&f);
}

static void write_part(struct board_fixture *f, unsigned size)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_write_profile_tag};
    lumi_wire_Reply reply = {0};
    struct lumi_error error;
    request.command.write_profile.data.size = (pb_size_t)size;
    memset(request.command.write_profile.data.bytes, (int)size, size);
    board_client_request(f->client, &request, &reply, &error);
    assert_int_equal(reply.result, lumi_wire_Result_DONE);
}

/* One packet each way, so that both ends would have stood at DATA1. */
static void a_cleared_halt_begins_with_data0(struct board_fixture *f, uint16_t endpoint)
{
    write_part(f, 4);
    assert_int_equal(usb_control(f->machine, 0x02, 3, 0, endpoint, NULL, 0, NULL), USB_DONE);
    assert_int_equal(usb_control(f->machine, 0x02, 1, 0, endpoint, NULL, 0, NULL), USB_DONE);
    usb_host_clear_toggle(f405_machine_usb(f->machine), endpoint);
    write_part(f, 4);
    assert_int_equal(board_client_wire(f->client)->retries, 0);
}

/* Three packets a round, so that not every one begins with DATA0 by chance. */
static void so_does_a_configuration(struct board_fixture *f)
{
    write_part(f, 4);
    write_part(f, 4);
    assert_int_equal(usb_control(f->machine, 0x00, 9, 1, 0, NULL, 0, NULL), USB_DONE);
    usb_host_clear_toggle(f405_machine_usb(f->machine), LUMI_WIRE_USB_OUT);
    usb_host_clear_toggle(f405_machine_usb(f->machine), LUMI_WIRE_USB_IN);
    write_part(f, 4);
    assert_int_equal(board_client_wire(f->client)->retries, 0);
}

static void a_request_that_is_broken_off_leaves_nothing_behind(void **state)
{
    static const uint8_t setup[2][8] = {{0x80, 6, 0, 1, 0, 0, 18, 0}, {0x80, 6, 0, 2, 0, 0, 32, 0}};
    struct board_fixture f;
    uint8_t data[64];
    size_t length = 0;
    (void)state;
    plugged(&f);
    struct f405 *chip = f405_machine_chip(f.machine);
    for (int i = 0; i < 6; i++) { /* one, or two at once; what they ask for is not fetched */
        assert_int_equal(f405_usb_setup(chip, 5, 0, setup[i & 1]), F405_USB_ACK);
        if (i >= 2)
            assert_int_equal(f405_usb_setup(chip, 5, 0, setup[~i & 1]), F405_USB_ACK);
        if (i < 4)
            f405_machine_run(f.machine, 0.001);
        assert_int_equal(usb_control(f.machine, 0x80, 8, 0, 0, data, sizeof data, &length), USB_DONE);
        assert_int_equal(length, 1);
        assert_int_equal(data[0], 1);
    }
    assert_int_equal(descriptor(&f, 2, 0, 0, data, sizeof data), 32);
    board_fixture_finish(&f);
}

static void a_halted_endpoint_stalls_until_it_is_cleared(void **state)
{
    struct board_fixture f;
    uint8_t data[64] = {0};
    (void)state;
    plugged(&f);
    for (int i = 0; i < 2; i++) {
        uint16_t endpoint = i ? LUMI_WIRE_USB_IN : LUMI_WIRE_USB_OUT;
        assert_int_equal(usb_control(f.machine, 0x02, 3, 0, endpoint, NULL, 0, NULL), USB_DONE);
        assert_int_equal(usb_control(f.machine, 0x82, 0, 0, endpoint, data, 2, NULL), USB_DONE);
        assert_int_equal(data[0], 1);
        assert_int_equal(usb_bulk(f.machine, endpoint, data, 4, false, 0.1, NULL), USB_STALLED);
        assert_int_equal(usb_control(f.machine, 0x02, 1, 0, endpoint, NULL, 0, NULL), USB_DONE);
        usb_host_clear_toggle(f405_machine_usb(f.machine), endpoint);
    }
    assert_int_equal(usb_bulk(f.machine, LUMI_WIRE_USB_OUT, data, 4, false, 0.1, NULL), USB_DONE);
    f.client = board_client_create(f.machine, BOARD_LINK_USB);
    BOARD_OK(board_client_open(f.client, 3, error));
    for (int i = 0; i < 6; i++)
        a_cleared_halt_begins_with_data0(&f, i & 1 ? LUMI_WIRE_USB_IN : LUMI_WIRE_USB_OUT);
    for (int i = 0; i < 3; i++)
        so_does_a_configuration(&f);
    board_fixture_finish(&f);
}

static void frames_of_every_length_pass_with_their_empty_packets(void **state)
{
    struct board_fixture f;
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_USB);
    for (unsigned size = 1; size <= 140; size++)
        write_part(&f, size);
    assert_int_equal(board_client_wire(f.client)->retries, 0);
    BOARD_OK(board_client_configure(f.client, &f.rig, error));
    const uint32_t retries = board_client_wire(f.client)->retries; /* while the flash was erased */
    uint32_t whole = 0;
    for (uint32_t size = 0; size <= 140; size++) { /* and back */
        lumi_wire_Request request = {.which_command = lumi_wire_Request_read_profile_tag};
        lumi_wire_Reply reply = {0};
        request.command.read_profile.offset = whole - (whole ? size : 0);
        BOARD_OK(board_client_request(f.client, &request, &reply, error));
        whole = reply.payload.profile.size;
        assert_true(whole > 140);
        assert_true(size == 0 || reply.payload.profile.data.size == size);
    }
    assert_int_equal(board_client_wire(f.client)->retries, retries);
    /* Empty packets and rubbish between frames do no harm. */
    uint8_t rubbish[130];
    memset(rubbish, 0x5a, sizeof rubbish);
    assert_int_equal(usb_bulk(f.machine, LUMI_WIRE_USB_OUT, rubbish, 0, false, 0.1, NULL), USB_DONE);
    assert_int_equal(usb_bulk(f.machine, LUMI_WIRE_USB_OUT, rubbish, sizeof rubbish, false, 0.1, NULL), USB_DONE);
    board_fixture_status(&f);
    board_fixture_finish(&f);
}

static void more_than_a_packet_holds_is_not_taken(void **state)
{
    struct board_fixture f;
    uint8_t data[65] = {0}, small[8];
    (void)state;
    plugged(&f);
    struct f405 *chip = f405_machine_chip(f.machine);
    assert_int_equal(f405_usb_out(chip, 5, 1, false, data, sizeof data), F405_USB_NONE);
    assert_int_equal(f405_usb_out(chip, 4, 1, false, data, 1), F405_USB_NONE); /* another device's address */
    assert_int_equal(f405_usb_out(chip, 5, 2, false, data, 1), F405_USB_NONE); /* an endpoint that is not there */
    /* The device sends more than the host has room for. */
    f.client = board_client_create(f.machine, BOARD_LINK_USB);
    BOARD_OK(board_client_open(f.client, 3, error));
    board_client_destroy(f.client);
    f.client = NULL;
    assert_int_equal(usb_control(f.machine, 0x80, 6, 0x0200, 0, small, 8, NULL), USB_DONE);
    board_fixture_finish(&f);
}

static void the_link_lives_through_suspend_reset_and_unplugging(void **state)
{
    struct board_fixture f;
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_USB);
    struct usb_host *host = f405_machine_usb(f.machine);
    uint32_t token = board_client_wire(f.client)->welcome.token;

    usb_host_suspend(host, true);
    BOARD_OK(board_client_run(f.client, 0.5, error));
    usb_host_suspend(host, false);
    BOARD_OK(board_client_run(f.client, 0.1, error));
    board_fixture_status(&f);

    usb_host_reset(host);
    assert_true(board_client_reconnect(f.client));
    board_fixture_status(&f);

    /* In the middle of a transfer: the first packet of three has gone. */
    uint8_t data[192] = {0};
    struct usb_transfer transfer = {.endpoint = LUMI_WIRE_USB_OUT, .data = data, .size = sizeof data};
    usb_host_submit(host, &transfer);
    for (int i = 0; i < 10000 && transfer.length < 64; i++)
        f405_machine_run(f.machine, 1e-6);
    assert_int_equal(transfer.status, USB_PENDING);
    usb_host_plug(host, false);
    assert_int_equal(transfer.status, USB_GONE);
    assert_true(transfer.length < sizeof data);
    f405_machine_run(f.machine, 0.5);
    usb_host_plug(host, true);
    assert_true(board_client_reconnect(f.client));
    board_fixture_status(&f);
    assert_int_equal(board_client_wire(f.client)->welcome.token, token); /* the same session all along */
    assert_int_equal(f405_resets(f405_machine_chip(f.machine)), 1);
    board_fixture_finish(&f);
}

static void the_board_goes_to_the_chips_own_loader_when_it_is_asked_to(void **state)
{
    struct board_fixture f;
    lumi_wire_Request request = {.which_command = lumi_wire_Request_enter_loader_tag};
    struct lumi_error error = {0};
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_USB);
    int code = board_client_request(f.client, &request, NULL, &error);
    if (code == LUMI_OK)
        code = board_client_run(f.client, 3, &error);
    assert_int_equal(code, LUMI_ERR_CANCELLED); /* the program counter is in system memory */
    assert_int_equal(f405_resets(f405_machine_chip(f.machine)), 2);
    board_fixture_finish(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_device_tells_what_it_is),
        cmocka_unit_test(windows_finds_its_driver_in_the_descriptors),
        cmocka_unit_test(what_the_device_does_not_know_is_stalled_and_nothing_hangs),
        cmocka_unit_test(a_request_that_is_broken_off_leaves_nothing_behind),
        cmocka_unit_test(a_halted_endpoint_stalls_until_it_is_cleared),
        cmocka_unit_test(frames_of_every_length_pass_with_their_empty_packets),
        cmocka_unit_test(more_than_a_packet_holds_is_not_taken),
        cmocka_unit_test(the_link_lives_through_suspend_reset_and_unplugging),
        cmocka_unit_test(the_board_goes_to_the_chips_own_loader_when_it_is_asked_to),
    };
    return board_image_is_there() ? cmocka_run_group_tests(tests, NULL, NULL) : 77;
}
