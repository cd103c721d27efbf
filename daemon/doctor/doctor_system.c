/* Network, disk, memory, clock. */
#include "daemon/doctor/doctor_priv.h"

#include "daemon/store/store.h"

#include <errno.h>
#include <glib.h>
#include <stdio.h>
#include <string.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#define DEFAULT_CAPTURES "/var/lib/lumisphere/captures"
#define SPEED_BYTES ((size_t)256 << 20)
/* A GigE camera sends a frame at wire speed: a buffer of some frames holds what comes while the program is not on. */
#define RMEM_WANTED (8.0 * 1024 * 1024)
#define MTU_WANTED 8000.0 /* jumbo frames of 9000 bytes, and what makers call so */

/* ---- network ---- */

static void check_interface(struct lumi_doctor *doctor, const char *name)
{
    g_autofree char *mtu_path = g_strdup_printf("/sys/class/net/%s/mtu", name);
    g_autofree char *type_path = g_strdup_printf("/sys/class/net/%s/type", name);
    g_autofree char *carrier_path = g_strdup_printf("/sys/class/net/%s/carrier", name);
    g_autofree char *wireless = g_strdup_printf("%s/sys/class/net/%s/wireless", doctor->options->root, name);
    g_autofree char *label = g_strdup_printf("network %s", name);
    g_autofree char *remedy =
        g_strdup_printf("if GigE cameras are on it, and its switch can: ip link set %s mtu 9000", name);
    double mtu, type, carrier;

    /* 1 is Ethernet (linux/if_arp.h) */
    if (!lumi_doctor_number(doctor, type_path, &type) || type != 1 || g_file_test(wireless, G_FILE_TEST_EXISTS) ||
        !lumi_doctor_number(doctor, carrier_path, &carrier) || carrier != 1 ||
        !lumi_doctor_number(doctor, mtu_path, &mtu))
        return;
    if (mtu >= MTU_WANTED)
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, label, NULL, "packets of %.0f bytes", mtu);
    else
        lumi_doctor_say(doctor, doctor->gige ? LUMI_DOCTOR_YELLOW : LUMI_DOCTOR_GREEN, label, remedy,
                        "packets of %.0f bytes: GigE cameras cost more processor time than with jumbo frames", mtu);
}

void lumi_doctor_network(struct lumi_doctor *doctor)
{
    g_autofree char *path = lumi_doctor_path(doctor, "/sys/class/net");
    GDir *folder = g_dir_open(path, 0, NULL);
    const char *name;
    double rmem;

    while (folder && (name = g_dir_read_name(folder)))
        check_interface(doctor, name);
    if (folder)
        g_dir_close(folder);
    if (!lumi_doctor_number(doctor, "/proc/sys/net/core/rmem_max", &rmem))
        return;
    if (rmem >= RMEM_WANTED)
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "network buffers", NULL, "up to %.0f KiB a socket", rmem / 1024);
    else
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "network buffers",
                        "for GigE cameras: net.core.rmem_max=33554432 in /etc/sysctl.d/70-lumid.conf, then sysctl "
                        "--system",
                        "up to %.0f KiB a socket: packets of GigE cameras may be lost", rmem / 1024);
}

/* ---- disk ---- */

static char *captures_folder(const struct lumi_doctor *doctor)
{
    g_autoptr(GKeyFile) file = g_key_file_new();
    char *folder = NULL;

    if (doctor->options->captures)
        return g_strdup(doctor->options->captures);
    if (g_key_file_load_from_file(file, doctor->options->config, G_KEY_FILE_NONE, NULL))
        folder = g_key_file_get_string(file, "capture", "folder", NULL);
    return folder ? folder : g_strdup(DEFAULT_CAPTURES);
}

static void check_speed(struct lumi_doctor *doctor, const char *folder)
{
    struct lumi_error error;
    double speed;

    if (lumi_store_measure(folder, SPEED_BYTES, &speed, &error) != LUMI_OK)
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "disk speed", NULL, "%s", error.text);
    else
        lumi_doctor_say(doctor, speed > 60e6 ? LUMI_DOCTOR_GREEN : LUMI_DOCTOR_YELLOW, "disk speed",
                        speed > 60e6 ? NULL : "'lumi capture plan' says what a sweep needs", "%.0f MB/s written",
                        speed * 1e-6);
}

void lumi_doctor_disk(struct lumi_doctor *doctor)
{
    g_autofree char *folder = captures_folder(doctor);
    struct statvfs is;
    g_autofree char *free_text = NULL;
    double free_bytes;

    if (statvfs(folder, &is)) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "disk",
                        "make it, lumid's user its owner; or name another: [capture] folder in lumid.conf",
                        "%s, where captures are to be kept, cannot be read: %s", folder, g_strerror(errno));
        return;
    }
    free_bytes = (double)is.f_bavail * (double)is.f_frsize;
    free_text = g_format_size((guint64)free_bytes);
    if (is.f_flag & ST_RDONLY)
        lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "disk", "mount it for writing", "%s is on a read-only file system",
                        folder);
    else if (free_bytes < 1e9)
        lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "disk", "make room, or name another folder", "%s free at %s",
                        free_text, folder);
    else
        lumi_doctor_say(doctor, free_bytes < 10e9 ? LUMI_DOCTOR_YELLOW : LUMI_DOCTOR_GREEN, "disk",
                        free_bytes < 10e9 ? "'lumi capture plan' says what a sweep needs" : NULL, "%s free at %s",
                        free_text, folder);
    if (doctor->options->speed)
        check_speed(doctor, folder);
}

/* ---- the rest ---- */

static void check_memory(struct lumi_doctor *doctor)
{
    g_autofree char *path = lumi_doctor_path(doctor, "/proc/meminfo");
    g_autofree char *text = NULL;
    const char *line;
    double kib;

    if (!g_file_get_contents(path, &text, NULL, NULL) || !(line = strstr(text, "MemAvailable:")))
        return;
    kib = g_ascii_strtod(line + strlen("MemAvailable:"), NULL);
    lumi_doctor_say(doctor, kib >= 1 << 20 ? LUMI_DOCTOR_GREEN : LUMI_DOCTOR_YELLOW, "memory",
                    kib >= 1 << 20 ? NULL : "lumid holds up to 512 MiB of frames: [store] memory in lumid.conf",
                    "%.1f GiB available", kib / (1 << 20));
}

static void check_usb_memory(struct lumi_doctor *doctor)
{
    double megabytes;

    if (lumi_doctor_number(doctor, "/sys/module/usbcore/parameters/usbfs_memory_mb", &megabytes) && megabytes &&
        megabytes < 256)
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "usb memory",
                        "for USB3 Vision cameras: usbcore.usbfs_memory_mb=1000 on the kernel's command line",
                        "%.0f MB for transfers of all devices", megabytes);
}

static void check_clock(struct lumi_doctor *doctor)
{
    struct timex state = {0};
    bool synchronised = adjtimex(&state) >= 0 && !(state.status & STA_UNSYNC);

    if (doctor->options->unix_s < 1735689600) /* 2025 */
        lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "clock", "timedatectl set-time, or a network with a time server",
                        "this computer's clock stands in the past: captures would have wrong dates");
    else if (!synchronised)
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "clock", "timedatectl set-ntp true, where there is a network",
                        "set, but by no time server; a capture's own times do not depend on it");
    else
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "clock", NULL, "synchronised with a time server");
}

void lumi_doctor_system(struct lumi_doctor *doctor)
{
    check_memory(doctor);
    check_usb_memory(doctor);
    check_clock(doctor);
}
