/* Is this computer ready for a rig. */
#include "daemon/doctor/doctor_priv.h"

#include <glib.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

void lumi_doctor_options_init(struct lumi_doctor_options *options)
{
    memset(options, 0, sizeof *options);
    options->root = "";
    options->config = "/etc/lumisphere/lumid.conf";
    options->lumid = "lumid";
    options->hardware = true;
}

const char *lumi_doctor_verdict_name(enum lumi_doctor_verdict verdict)
{
    static const char *const names[] = {"green", "yellow", "red"};

    return names[verdict];
}

void lumi_doctor_say(struct lumi_doctor *doctor, enum lumi_doctor_verdict verdict, const char *name, const char *remedy,
                     const char *found, ...)
{
    struct lumi_doctor_finding finding = {.verdict = verdict};
    va_list arguments;

    snprintf(finding.name, sizeof finding.name, "%s", name);
    snprintf(finding.remedy, sizeof finding.remedy, "%s", remedy ? remedy : "");
    va_start(arguments, found);
    vsnprintf(finding.found, sizeof finding.found, found, arguments);
    va_end(arguments);
    doctor->tell(doctor->context, &finding);
}

char *lumi_doctor_path(const struct lumi_doctor *doctor, const char *path)
{
    return g_strconcat(doctor->options->root, path, NULL);
}

bool lumi_doctor_number(const struct lumi_doctor *doctor, const char *path, double *value)
{
    g_autofree char *whole = lumi_doctor_path(doctor, path);
    g_autofree char *text = NULL;
    char *end;

    if (!g_file_get_contents(whole, &text, NULL, NULL))
        return false;
    *value = g_ascii_strtod(text, &end);
    return end != text;
}

/* lumid reads its configuration itself: it is asked what it thinks of it. */
static void check_config(struct lumi_doctor *doctor)
{
    const char *config = doctor->options->config;
    char *argv[] = {(char *)doctor->options->lumid, (char *)"--check", (char *)"--config", (char *)config, NULL};
    g_autofree char *out = NULL, *said = NULL;
    g_autoptr(GError) failed = NULL;
    int status;

    if (!doctor->options->lumid)
        return;
    if (!g_file_test(config, G_FILE_TEST_EXISTS)) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "configuration", "lumid --print-config writes one with every key",
                        "%s is not there", config);
        return;
    }
    if (!g_spawn_sync(NULL, argv, NULL, G_SPAWN_SEARCH_PATH, NULL, NULL, &out, &said, &status, &failed)) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_YELLOW, "configuration", "install the package, or put lumid into PATH",
                        "%s is there, but not lumid, which checks it: %s", config, failed->message);
        return;
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
        lumi_doctor_say(doctor, LUMI_DOCTOR_GREEN, "configuration", NULL, "%s is good", config);
        return;
    }
    g_auto(GStrv) lines = g_strsplit(g_strstrip(said), "\n", -1);
    for (int i = 0; lines[i]; i++)
        lumi_doctor_say(doctor, LUMI_DOCTOR_RED, "configuration",
                        lines[i + 1] ? NULL : "lumid --check tells more; lumid.conf(5) has every key", "%s", lines[i]);
}

void lumi_doctor_run(const struct lumi_doctor_options *options, lumi_doctor_fn tell, void *context)
{
    struct lumi_doctor doctor = {.options = options, .tell = tell, .context = context};

    lumi_doctor_devices(&doctor);
    lumi_doctor_network(&doctor);
    lumi_doctor_disk(&doctor);
    lumi_doctor_system(&doctor);
    check_config(&doctor);
}
