/* What a program that drives the rig is told of it: profile, plan, lumid's configuration. */
#include "sim/gige/rig_parts.h"

#include "proto/base/file.h"

#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <glib.h>

static int write_text(const struct sim_rig_processes *rig, const char *name, const char *text, struct lumi_error *error)
{
    g_autofree char *path = g_strdup_printf("%s/%s", rig->folder, name);
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    const int code = fd < 0 ? -1 : lumi_write_all(fd, text, strlen(text));

    if (code != 0)
        lumi_fail_errno(error, path, "writing");
    if (fd >= 0)
        close(fd);
    return code == 0 ? LUMI_OK : LUMI_ERR_IO;
}

int rig_plan_write(const struct sim_rig_processes *rig, struct lumi_error *error)
{
    char text[LUMI_PLAN_TEXT_MAX];
    struct lumi_plan plan;

    lumi_plan_init(&plan, &rig->rig);
    plan.mode = rig->continuous ? LUMI_PLAN_CONTINUOUS : LUMI_PLAN_START_STOP;
    plan.position_time = rig->position_time;
    plan.turn_time = rig->position_time * plan.positions;
    plan.exposures[0] = rig->exposure;
    LUMI_TRY(lumi_plan_check(&plan, &rig->rig, error));
    lumi_plan_print(&plan, &rig->rig, text, sizeof text);
    return write_text(rig, "plan.txt", text, error);
}

static void describe_camera(const struct sim_rig_processes *rig, int camera, GString *text)
{
    char serial[16], address[16];

    sim_rig_processes_serial(rig, camera, serial);
    sim_rig_processes_address(rig, camera, address);
    g_string_append_printf(text,
                           "\n[camera %s]\n# at %s\naddress = aravis:%s\ntrigger = hardware\ntrigger_input = Line1\n"
                           "gain = 1\nlayout = %s\n",
                           rig->rig.cameras[camera].name, address, serial, rig->layout);
    if (rig->bits > 0)
        g_string_append_printf(text, "bits = %d\n", rig->bits);
}

static void describe_drive(const struct sim_rig_processes *rig, GString *text)
{
    char address[16];

    sim_rig_processes_address(rig, rig->rig.camera_count, address);
    g_string_append_printf(text, "drive = tcp:%s:%d\ndrive_map = %s/drive.map\n", address, SIM_RIG_DRIVE_PORT,
                           rig->folder);
}

static int write_configuration(const struct sim_rig_processes *rig, struct lumi_error *error)
{
    g_autoptr(GString) text = g_string_new("# A simulated rig, by lumi sim rig: lumid --config THIS-FILE\n");
    g_autofree char *captures = g_strdup_printf("%s/captures", rig->folder);

    if (mkdir(captures, 0777) != 0 && access(captures, W_OK) != 0)
        return lumi_fail_errno(error, captures, "making the folder");
    /* Drawing is slower than a camera, and several share a processor: a frame may be late. */
    g_string_append_printf(text, "\n[rig]\nlink = serial:%s/board\n", rig->folder);
    if (rig->drive)
        describe_drive(rig, text);
    g_string_append_printf(text,
                           "\n[capture]\nfolder = %s\nframe_patience_s = %g\n"
                           "memory = 256M\n\n[http]\nlisten = localhost:%d\nsecure = *:%d\naccess = %s/access\n",
                           captures, rig->patience, rig->port, rig->port ? rig->port + 1 : 0, rig->folder);
    if (rig->preview) {
        g_autofree char *quoted = g_shell_quote(rig->preview);
        g_string_append_printf(text, "\n[preview]\ncommand = %s preview %%c --serve\n", quoted);
    }
    if (rig->process)
        g_string_append_printf(text, "\n[process]\ncommand = %s\n", rig->process);
    for (int i = 0; i < rig->rig.camera_count; i++)
        describe_camera(rig, i, text);
    return write_text(rig, "lumid.conf", text->str, error);
}

int rig_files_write(const struct sim_rig_processes *rig, struct lumi_error *error)
{
    g_autofree char *text = g_malloc(LUMI_RIG_TEXT_MAX);

    lumi_rig_print(&rig->rig, text, LUMI_RIG_TEXT_MAX);
    LUMI_TRY(write_text(rig, "rig.txt", text, error));
    if (rig->drive)
        LUMI_TRY(write_text(rig, "drive.map", rig_drive_map, error));
    return write_configuration(rig, error);
}
