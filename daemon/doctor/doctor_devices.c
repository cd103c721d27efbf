/* What was built in, what is plugged in, and whether this user may open it. */
#include "daemon/doctor/doctor_priv.h"

#include "daemon/camera/camera_device.h"
#include "daemon/gpio/gpio.h"
#include "daemon/rig/stream.h"

#include <glib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define CAMERAS_MAX 64
#define BOARDS_MAX 8

static void check_backends(struct lumi_doctor *doctor)
{
    g_autoptr(GString) built = g_string_new(NULL);

    for (int i = 0; i < LUMI_CAMERA_BACKENDS; i++) {
        const char *name = lumi_camera_backend_name((enum lumi_camera_backend)i);
        const char *why = lumi_camera_backend_missing((enum lumi_camera_backend)i);
        g_autofree char *label = g_strdup_printf("cameras: %s", name);
        if (why)
            lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, label,
                            "only where you have such cameras: install it and build again", "left out: %s", why);
        else
            g_string_append_printf(built, "%s%s", built->len ? ", " : "", name);
    }
    lumi_doctor_say(doctor, built->len ? LUMI_DOCTOR_GREEN : LUMI_DOCTOR_RED, "cameras: built in", NULL, "%s",
                    built->len ? built->str : "none");
    lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "gpio", NULL, "%s", lumi_gpio_library());
}

/* "192.168.1.7": a camera on the network. */
static bool is_network(const struct lumi_camera_identity *camera)
{
    return camera->backend == LUMI_CAMERA_ARAVIS && strchr(camera->address, '.') && !strpbrk(camera->address, "/:");
}

static void check_cameras(struct lumi_doctor *doctor)
{
    g_autofree struct lumi_camera_identity *cameras = g_new0(struct lumi_camera_identity, CAMERAS_MAX);
    struct lumi_error error;
    int count = lumi_camera_list(cameras, CAMERAS_MAX, &error);

    if (count < 0) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "cameras", NULL, "%s", error.text);
        return;
    }
    for (int i = 0; i < count && i < CAMERAS_MAX; i++) {
        doctor->gige += is_network(&cameras[i]);
        for (int k = 0; k < i; k++)
            if (cameras[i].backend == cameras[k].backend && *cameras[i].serial &&
                !strcmp(cameras[i].serial, cameras[k].serial))
                lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "cameras", "only one of them can be used at a time",
                                "%s and %s have one serial number, %s", cameras[k].address, cameras[i].address,
                                cameras[i].serial);
    }
    lumi_doctor_say(doctor, count ? LUMI_DOCTOR_GREEN : LUMI_DOCTOR_YELLOW, "cameras",
                    count ? NULL : "power, cables; 'lumi devices' lists them", "%d found", count);
}

static void check_boards(struct lumi_doctor *doctor)
{
    struct lumi_rig_usb_board boards[BOARDS_MAX];
    struct lumi_error error;
    int count = lumi_rig_usb_list(boards, BOARDS_MAX, &error), bad = 0;

    if (count < 0) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "board", NULL, "%s", error.text);
        return;
    }
    for (int i = 0; i < count && i < BOARDS_MAX; i++)
        if (*boards[i].text) {
            lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "board", "see 'udev rules' and 'groups'", "USB %s: %s",
                            boards[i].place, boards[i].text);
            bad++;
        }
    if (!count)
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "board", "power, cable; a board on a serial line is not seen here",
                        "none on USB");
    else if (!bad)
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "board", NULL, "%d on USB", count);
}

static bool rule_is_there(const struct lumi_doctor *doctor, const char *name)
{
    static const char *const folders[] = {"/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d",
                                          "/usr/local/lib/udev/rules.d"};

    for (size_t i = 0; i < sizeof folders / sizeof folders[0]; i++) {
        g_autofree char *folder = lumi_doctor_path(doctor, folders[i]);
        g_autofree char *path = g_build_filename(folder, name, NULL);
        if (g_file_test(path, G_FILE_TEST_EXISTS))
            return true;
    }
    return false;
}

static void check_rules(struct lumi_doctor *doctor)
{
    static const char *const rules[][2] = {
        {"70-lumirig.rules", "only root may open the board"},
        {"71-lumid.rules", "only root may use USB3 Vision cameras and GPIO lines, and cameras may be put to sleep"}};
    bool whole = true;

    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++) {
        if (rule_is_there(doctor, rules[i][0]))
            continue;
        whole = false;
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "udev rules",
                        "install the package, or copy it to /etc/udev/rules.d and run udevadm control --reload",
                        "%s is not installed: %s", rules[i][0], rules[i][1]);
    }
    if (whole)
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "udev rules", NULL, "%s and %s are installed", rules[0][0],
                        rules[1][0]);
}

/* Is the user, by name, or one of the groups of this program in the line of /etc/group? */
static int group_id(const struct lumi_doctor *doctor, const char *name)
{
    g_autofree char *path = lumi_doctor_path(doctor, "/etc/group");
    g_autofree char *text = NULL;

    if (!g_file_get_contents(path, &text, NULL, NULL))
        return -1;
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
    for (int i = 0; lines[i]; i++) {
        g_auto(GStrv) fields = g_strsplit(lines[i], ":", 4);
        if (g_strv_length(fields) >= 3 && !strcmp(fields[0], name))
            return atoi(fields[2]);
    }
    return -1;
}

static void check_groups(struct lumi_doctor *doctor)
{
    static const char *const groups[][2] = {
        {"plugdev", "the board on USB"}, {"dialout", "serial lines"}, {"video", "cameras on USB"}};
    gid_t mine[256];
    int count = getgroups(256, mine), missing = 0;

    if (!doctor->options->user) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "groups", NULL, "root may open everything");
        return;
    }
    for (size_t i = 0; i < sizeof groups / sizeof groups[0]; i++) {
        int id = group_id(doctor, groups[i][0]);
        bool member = id >= 0 && getgid() == (gid_t)id;
        g_autofree char *remedy =
            g_strdup_printf("sudo usermod -aG %s %s, then log in again", groups[i][0], g_get_user_name());
        for (int k = 0; k < count && id >= 0; k++)
            member |= mine[k] == (gid_t)id;
        if (member || id < 0)
            continue;
        missing++;
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "groups", remedy,
                        "%s is not in the group %s, which may open %s (lumid, as a service, is)", g_get_user_name(),
                        groups[i][0], groups[i][1]);
    }
    if (!missing)
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "groups", NULL, "%s is in plugdev, dialout, video",
                        g_get_user_name());
}

void lumi_doctor_devices(struct lumi_doctor *doctor)
{
    check_backends(doctor);
    check_rules(doctor);
    check_groups(doctor);
    if (doctor->options->hardware) {
        check_boards(doctor);
        check_cameras(doctor);
    }
}
