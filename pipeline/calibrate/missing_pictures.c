/* What a capture should hold and does not: rows, single pictures, shots of brackets. */
#include "pipeline/calibrate/calibration.h"

#include <string.h>

#define SHOWN 6 /* positions that a line names */

/* A camera's pictures of one turn. */
struct row {
    int there, missing;
    const char *why;
    GString *positions;
};

static void count_row(const struct lumi_run *run, const char *camera, int turn, struct row *row)
{
    for (int i = 0; i < run->count; i++)
        row->there += run->sources[i].turn == turn && !strcmp(run->sources[i].camera_name, camera);
    for (int i = 0; i < run->missing_count; i++) {
        const struct lumi_missing *m = &run->missing[i];
        if (m->part || m->turn != turn || strcmp(m->camera_name, camera) != 0)
            continue;
        if (row->missing++ < SHOWN)
            g_string_append_printf(row->positions, "%s%d", row->positions->len ? ", " : "", m->position);
        if (!row->why && m->why[0])
            row->why = m->why;
    }
    if (row->missing > SHOWN)
        g_string_append(row->positions, ", …");
}

/* Positions of a turn at which any camera has a picture. */
static int positions_seen(const struct lumi_run *run, int turn)
{
    g_autoptr(GHashTable) seen = g_hash_table_new(NULL, NULL);

    for (int i = 0; i < run->count; i++)
        if (run->sources[i].turn == turn)
            g_hash_table_add(seen, GINT_TO_POINTER(run->sources[i].position));
    return (int)g_hash_table_size(seen);
}

static void judge_row(const struct lumi_run *run, struct lumi_calibration *c, const char *camera, int turn, int seen)
{
    g_autoptr(GString) positions = g_string_new(NULL);
    g_autofree char *what = g_strdup_printf("camera %s", camera);
    struct row row = {.positions = positions};

    count_row(run, camera, turn, &row);
    const int all = MAX(row.there + row.missing, seen);
    if (row.there == 0)
        lumi_calibration_find(c, 0, what,
                              "has 0 of %d pictures in turn %d: a missing row%s%s; the light field is thin there. Take "
                              "the row again, or import it if it was forgotten",
                              all, turn, row.why ? ": " : "", row.why ? row.why : "");
    else if (row.missing > 0)
        lumi_calibration_find(c, 0, what,
                              "lacks %d of %d pictures in turn %d (positions %s)%s%s; the light field is thin there. "
                              "Take them again if that shows",
                              row.missing, all, turn, positions->str, row.why ? ": " : "", row.why ? row.why : "");
    else if (2 * row.there < all)
        lumi_calibration_find(c, 0, what,
                              "has %d of %d pictures in turn %d; the light field is thin there. Take the row again, "
                              "or import it if it was forgotten",
                              row.there, all, turn);
}

static void find_missing_rows(const struct lumi_run *run, struct lumi_calibration *c)
{
    for (int turn = 0; run->rig && turn < run->rig->turns; turn++) {
        const int seen = positions_seen(run, turn);
        if (seen == 0) {
            lumi_calibration_find(c, 0, "rig",
                                  "there is no picture of turn %d at all; the light field is thin there. "
                                  "Take it again, or import it if it was forgotten",
                                  turn);
            continue;
        }
        for (int camera = 0; camera < run->rig->camera_count; camera++)
            judge_row(run, c, run->rig->cameras[camera].name, turn, seen);
    }
}

static bool has_part(const struct lumi_source *source, double offset)
{
    for (int i = 0; i < source->part_count; i++)
        if (source->parts[i].exposure_offset == offset)
            return true;
    return false;
}

/* A picture with as many shots as any. */
static const struct lumi_source *fullest(const struct lumi_run *run)
{
    const struct lumi_source *most = &run->sources[0];

    for (int i = 1; i < run->count; i++)
        if (run->sources[i].part_count > most->part_count)
            most = &run->sources[i];
    return most;
}

static void find_short_brackets(const struct lumi_run *run, struct lumi_calibration *c)
{
    const struct lumi_source *whole = fullest(run), *first = NULL;
    g_autoptr(GString) stops = g_string_new(NULL);
    int count = 0;

    for (int i = 0; i < run->count; i++)
        if (run->sources[i].part_count < whole->part_count) {
            first = first ? first : &run->sources[i];
            count++;
        }
    if (!first)
        return;
    for (int i = 0; i < whole->part_count; i++)
        if (!has_part(first, whole->parts[i].exposure_offset))
            g_string_append_printf(stops, "%s%+g", stops->len ? ", " : "", whole->parts[i].exposure_offset);
    lumi_calibration_find(c, 0, "brackets",
                          "of unequal length: %d of %d pictures lack a shot (%s that of %s stops), and are made of the "
                          "others: what is very bright or very dark is worse there. Take them again if that shows",
                          count, run->count, first->name, stops->str);
}

void lumi_calibration_missing(const struct lumi_run *run, struct lumi_calibration *c)
{
    find_missing_rows(run, c);
    find_short_brackets(run, c);
}
