/* What lumid says: one line each, to the journal with its priority, to a terminal with its name. */
#include "daemon/lumid/service.h"

#include <glib.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

void lumi_service_log(int priority, const char *format, ...)
{
    char text[2048];
    va_list list;

    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    for (char *c = text; *c; c++) /* what devices say may hold anything */
        if ((unsigned char)*c < ' ' || *c == 127)
            *c = ' ';
    if (getenv("JOURNAL_STREAM"))
        fprintf(stderr, "<%d>%s\n", priority, text);
    else
        fprintf(stderr, "lumid: %s\n", text);
}

static void on_said(const char *domain, GLogLevelFlags level, const char *text, void *context)
{
    (void)domain;
    (void)context;
    if (level & (G_LOG_LEVEL_ERROR | G_LOG_LEVEL_CRITICAL))
        lumi_service_log(3, "%s", text);
    else if (level & G_LOG_LEVEL_WARNING)
        lumi_service_log(4, "%s", text);
    else if (level & G_LOG_LEVEL_MESSAGE)
        lumi_service_log(6, "%s", text);
}

void lumi_service_log_libraries(void)
{
    g_log_set_default_handler(on_said, NULL);
}
