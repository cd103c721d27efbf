/* lumid.conf: what it means, and that everything wrong with it is named with its place. */
#include "daemon/lumid/config_keys.h"
#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct said {
    int count;
    char text[8][768];
};
static void listen(void *context, const char *text)
{
    struct said *said = context;

    if (said->count < 8)
        strcpy(said->text[said->count], text);
    said->count++;
}

static struct lumi_config *config;
static struct said said;

static int parse(const char *text)
{
    struct lumi_error error = {0};

    said = (struct said){0};
    int code = lumi_config_parse(text, strlen(text), "f", config, listen, &said, &error);
    assert_int_equal(code == LUMI_OK, said.count == 0);
    assert_int_equal(code, error.code);
    return code;
}

static void is_wrong(const char *text, const char *expected)
{
    assert_int_equal(parse(text), LUMI_ERR_FORMAT);
    if (said.count != 1 || strstr(said.text[0], expected) != said.text[0])
        fail_msg("%s: %d problems, the first: %s", text, said.count, said.text[0]);
}

static int set_up(void **state)
{
    (void)state;
    config = malloc(sizeof *config);
    return config ? 0 : -1;
}
static int tear_down(void **state)
{
    (void)state;
    free(config);
    return 0;
}

static void an_empty_file_means_the_defaults(void **state)
{
    (void)state;
    assert_int_equal(parse(""), LUMI_OK);
    assert_string_equal(config->link, "usb:");
    assert_string_equal(config->listen, "localhost:8470");
    assert_string_equal(config->engine.folder, "/var/lib/lumisphere/captures");
    assert_int_equal(config->engine.retakes, 3);
    assert_int_equal(config->engine.store.memory, 512u << 20);
    assert_true(config->engine.verify && config->engine.judging);
    assert_int_equal(config->engine.camera_count, 0);
}

static void every_default_and_example_can_be_read(void **state)
{
    struct lumi_engine_camera camera;
    struct lumi_gpio_line line;
    char why[256];

    (void)state;
    for (int i = 0; i < lumi_config_key_count; i++) {
        const struct lumi_config_key *key = &lumi_config_keys[i];
        void *base = strcmp(key->group, "camera") == 0 ? (void *)&camera : config;
        assert_true(*key->standard || key->example);
        assert_null(lumi_config_read(key, key->standard, base, &line, why, sizeof why));
        if (key->example && lumi_config_read(key, key->example, base, &line, why, sizeof why))
            fail_msg("%s %s: its example is refused", key->group, key->name);
    }
}

/* Uncommented, every line of the printed file is read; as it is, it means the defaults. */
static void the_printed_file_is_the_default(void **state)
{
    struct lumi_config *printed = malloc(sizeof *printed);
    char *text = lumi_config_print();

    (void)state;
    assert_int_equal(parse(text), LUMI_OK);
    memcpy(printed, config, sizeof *printed);
    lumi_config_init(config);
    assert_memory_equal(printed, config, sizeof *printed);
    for (char *c = text; *c; c++) /* "#key" begins a value, "# word" a comment */
        if (*c == '#' && c[1] != ' ' && (c == text || c[-1] == '\n'))
            *c = ' ';
    assert_int_equal(parse(text), LUMI_OK);
    assert_int_equal(config->engine.camera_count, 1);
    assert_int_equal(config->gpio_count, 5);
    lumi_free(text);
    free(printed);
}

static void cameras_have_their_settings_and_lines(void **state)
{
    (void)state;
    assert_int_equal(parse("[camera c00]\naddress=aravis:A1\ntrigger = software\nexposure_s = 0.004\n"
                           "gain = 2\nblack_level = 64\nwhite_red = 1.7\nwhite_blue = 1.4\noptional = yes\n; a "
                           "comment\n[camera c01] \naddress = files:/media/card\n"
                           "sync = gpio-sim.0:7,active-low\n\n[gpio]\n\testop = gpiochip0:stop,debounce_us=500"),
                     LUMI_OK);
    const struct lumi_engine_camera *cameras = config->engine.cameras;
    assert_int_equal(config->engine.camera_count, 2);
    assert_string_equal(cameras[0].name, "c00");
    assert_string_equal(cameras[0].address, "aravis:A1");
    assert_int_equal(cameras[0].setting.trigger, LUMI_TRIGGER_SOFTWARE);
    assert_true(cameras[0].setting.exposure_s == 0.004 && cameras[0].setting.gain == 2);
    assert_true(cameras[0].black == 64 && cameras[0].white_red == 1.7 && cameras[0].white_blue == 1.4);
    assert_true(cameras[1].black == 0 && cameras[1].white_red == 0);
    assert_true(cameras[0].optional && !cameras[0].sync_line);
    assert_true(cameras[0].setting.chunk_data && cameras[1].setting.chunk_data); /* as a camera without a file has it */
    assert_int_equal(cameras[1].setting.trigger, LUMI_TRIGGER_HARDWARE);
    assert_true(!cameras[1].optional && cameras[1].sync_line);
    assert_int_equal(config->gpio_count, 2);
    assert_int_equal(config->gpio[0].role, LUMI_GPIO_SYNC);
    assert_string_equal(config->gpio[0].camera, "c01");
    assert_int_equal(config->gpio[0].offset, 7);
    assert_true(config->gpio[0].active_low);
    assert_int_equal(config->gpio[1].role, LUMI_GPIO_ESTOP);
    assert_int_equal(config->gpio[1].offset, -1);
    assert_string_equal(config->gpio[1].line_name, "stop");
    assert_int_equal(config->gpio[1].debounce_us, 500);
}

static void each_wrong_thing_is_named_with_its_place(void **state)
{
    (void)state;
    is_wrong("[rig]\n\nlnk = usb:\n", "f:3: [rig] lnk: there is no such key");
    is_wrong("[rigs]\nanything = 1\n", "f:1: [rigs]: there is no such group");
    is_wrong("link = usb:\n", "f:1: link: a key before the first [GROUP]");
    is_wrong("[rig]\nlink\n", "f:2: no KEY = VALUE");
    is_wrong("[rig\n", "f:1: a group is written [NAME]");
    is_wrong("[rig]\nlink = bluetooth:1\n", "f:2: [rig] link: \"bluetooth:1\" is no board's address");
    is_wrong("[rig]\nlink = usb:\nlink = usb:\n", "f:3: [rig] link: it is there already");
    is_wrong("[rig]\n[rig]\n", "f:2: [rig]: this group is there already");
    is_wrong("[rig]\nhome_turn = 1.5\n", "f:2: [rig] home_turn: \"1.5\" must be a whole number");
    is_wrong("[rig]\nhome_turn = 256\n", "f:2: [rig] home_turn: \"256\" must be between 0 and 255");
    is_wrong("[rig]\npatience_s = nan\n", "f:2: [rig] patience_s: \"nan\" is no number");
    is_wrong("[rig]\nwind_up = maybe\n", "f:2: [rig] wind_up: \"maybe\" must be yes or no");
    is_wrong("[rig]\ndrive = tcp:x\n", "f:2: [rig] drive_map: it must be given, too");
    is_wrong("[capture]\nfolder = here\n", "f:2: [capture] folder: \"here\" is no path from the root");
    is_wrong("[capture]\nmemory = 1Z\n", "f:2: [capture] memory: \"1Z\" is no number of bytes");
    is_wrong("[capture]\nfolder = /a\nsecond_copy = /a\n", "f:3: [capture] second_copy: it is the folder itself");
    is_wrong("[camera c/0]\naddress = x\n", "f:1: [camera c/0]: a camera's name is");
    is_wrong("[camera]\n", "f:1: [camera ]: a camera's name is");
    is_wrong("[camera a]\n", "f:1: [camera a] address: it must be given");
    is_wrong("[camera a]\naddress = x\ntrigger = no\n",
             "f:3: [camera a] trigger: \"no\" must be one of free, hardware, software");
    is_wrong("[gpio]\nestop = 5\n", "f:2: [gpio] estop: \"5\" must be CHIP:LINE");
    is_wrong("[gpio]\nlamp = a:5,debounce_us=3\n", "f:2: [gpio] lamp: \"a:5,debounce_us=3\" only an emergency stop");
    is_wrong("[gpio]\nlamp = a:5\npower=a:5\n", "f:3: [gpio]: this line is used in line 2 already");
    is_wrong("[http]\nlisten = 0.0.0.0:80\n", "f:2: [http] listen: 0.0.0.0:80 is not this computer alone");
    is_wrong("[http]\nlisten = localhost\n", "f:2: [http] listen: \"localhost\" is no ADDRESS:PORT");
    is_wrong("[http]\ncertificate = /c\n", "f:2: [http] key: it must be given, too");
    is_wrong("[rig]\n\033[31m = 1\n", "f:2: [rig] ?[31m: there is no such key");
}

static void two_cameras_with_one_serial_are_refused(void **state)
{
    (void)state;
    is_wrong("[camera a]\naddress = aravis:7\n[camera b]\naddress = aravis:7\n",
             "f:3: [camera b] address: \"aravis:7\" is camera a already");
    is_wrong("[camera a]\naddress = aravis:7\n[camera b]\naddress = 7\n",
             "f:3: [camera b] address: \"7\" is camera a already");
    is_wrong("[camera a]\naddress = 7\n[camera a]\naddress = 8\n", "f:3: [camera a]: it is there already, in line 1");
    assert_int_equal(parse("[camera a]\naddress = aravis:7\n[camera b]\naddress = aravis:70\n"), LUMI_OK);
}

static void all_wrong_things_are_named_not_only_the_first(void **state)
{
    struct lumi_error error = {0};
    const char *text = "[rig]\nlink = x\nhome_turn = -1\n[no]\na = 1\n";

    (void)state;
    parse(text);
    assert_int_equal(said.count, 3);
    assert_int_equal(lumi_config_parse(text, strlen(text), "f", config, NULL, NULL, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "f:2: [rig] link"));
    assert_non_null(strstr(error.text, "(and 2 more)"));
}

static void what_the_machine_lacks_is_named_by_its_key(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(parse("[capture]\nfolder = /nowhere/captures\n[http]\ntoken_file = /nowhere/token\n"), LUMI_OK);
    said = (struct said){0};
    assert_int_equal(lumi_config_check_host(config, "f", listen, &said, &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(said.count, 2);
    assert_string_equal(said.text[0],
                        "f: [capture] folder: /nowhere/captures: is to be written to: No such file or directory");
    assert_string_equal(said.text[1], "f: [http] token_file: /nowhere/token: is to be read: No such file or directory");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_file_means_the_defaults),
        cmocka_unit_test(every_default_and_example_can_be_read),
        cmocka_unit_test(the_printed_file_is_the_default),
        cmocka_unit_test(cameras_have_their_settings_and_lines),
        cmocka_unit_test(each_wrong_thing_is_named_with_its_place),
        cmocka_unit_test(two_cameras_with_one_serial_are_refused),
        cmocka_unit_test(all_wrong_things_are_named_not_only_the_first),
        cmocka_unit_test(what_the_machine_lacks_is_named_by_its_key),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
