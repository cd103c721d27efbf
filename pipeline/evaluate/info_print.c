/* What a capture or a field holds, in numbers: written for people and for programs. */
#include "pipeline/evaluate/info.h"

#include "pipeline/run/json_put.h"

#include <glib.h>
#include <inttypes.h>
#include <math.h>

static const char *const level_names[LUMI_LEVELS] = {[LUMI_LEVEL_COARSE] = "coarse", [LUMI_LEVEL_FINE] = "fine"};
static const char *const shape_names[] = {[LUMI_DISK_OVAL] = "oval", [LUMI_DISK_RECTANGLE] = "rectangle"};
static const char *const kernel_names[] = {
    [LUMI_KERNEL_LINEAR] = "linear", [LUMI_KERNEL_GAUSSIAN] = "gaussian", [LUMI_KERNEL_CUBIC] = "cubic"};
static const char *const surface_names[] = {[LUMI_SURFACE_SPHERE] = "sphere", [LUMI_SURFACE_PLANE] = "plane"};

static double degrees(double radians)
{
    return radians * 180 / G_PI;
}

static double ratio(uint64_t raw, uint64_t coded)
{
    return coded ? (double)raw / (double)coded : 0;
}

static void put_size(GString *text, const char *part, uint64_t bytes, uint64_t whole)
{
    g_string_append_printf(text, "  %-26s %14" PRIu64 " bytes  %5.1f %%\n", part, bytes, 100 * ratio(bytes, whole));
}

static void put_factor(GString *text, const char *what, uint64_t pixels, uint64_t bytes)
{
    uint64_t raw = pixels * LUMI_INFO_RAW_BYTES;
    g_string_append_printf(text, "  %-26s %14.1f times  (%" PRIu64 " bytes as 24-bit RGB)\n", what, ratio(raw, bytes),
                           raw);
}

static void put_states(GString *text, const struct lumi_capture_summary *summary)
{
    for (int state = 0; state < 6; state++)
        if (summary->info.in_state[state])
            g_string_append_printf(text, ", %d %s", summary->info.in_state[state],
                                   lumi_frame_state_name((enum lumi_frame_state)state));
}

static void put_poses(GString *text, const struct lumi_capture_summary *summary)
{
    g_string_append_printf(text, "poses     %d of %d frames", summary->info.with_pose, summary->info.frames);
    for (int source = LUMI_POSE_TRUE; source <= LUMI_POSE_IMPORTED; source++)
        if (summary->in_pose_source[source])
            g_string_append_printf(text, ", %d %s", summary->in_pose_source[source],
                                   lumi_pose_source_name((enum lumi_pose_source)source));
    g_string_append_c(text, '\n');
}

static void capture_text(GString *text, const struct lumi_capture_summary *summary, const char *path)
{
    const struct lumi_capture_info *info = &summary->info;
    uint64_t frames = (uint64_t)info->frame_bytes, database = (uint64_t)info->database_bytes;
    uint64_t rest = summary->total_bytes > frames + database ? summary->total_bytes - frames - database : 0;

    g_string_append_printf(text, "%s: capture, version %d, %s\n", path, info->version,
                           info->sealed ? "sealed" : "open");
    const char *const metas[][2] = {{"title", summary->title},
                                    {"made by", summary->source},
                                    {"created", summary->created},
                                    {"software", summary->software},
                                    {"surface", summary->surface}};
    for (size_t i = 0; i < G_N_ELEMENTS(metas); i++)
        if (metas[i][1][0])
            g_string_append_printf(text, "%-9s %s\n", metas[i][0], metas[i][1]);
    g_string_append_printf(text, "rig       %d cameras, %d lenses, %d positions, %d shots\n", info->cameras,
                           info->lenses, info->positions, info->shots);
    g_string_append_printf(text, "frames    %d", info->frames);
    put_states(text, summary);
    g_string_append_c(text, '\n');
    if (summary->sizes)
        g_string_append_printf(text, "images    %d×%d%s, %s\n", summary->width, summary->height,
                               summary->sizes > 1 ? " and other sizes" : "", summary->extensions);
    put_poses(text, summary);
    g_string_append(text, "sizes\n");
    put_size(text, "images", frames, summary->total_bytes);
    put_size(text, "index (database)", database, summary->total_bytes);
    put_size(text, "manifests and the rest", rest, summary->total_bytes);
    put_size(text, "all", summary->total_bytes, summary->total_bytes);
    if (summary->pixels)
        put_factor(text, "compression, images", summary->pixels, frames);
}

static void put_level(GString *text, const struct lumi_field_summary *summary, int level)
{
    g_string_append_printf(text, "%-9s %d views of %d×%d pixels, %.1f° × %.1f°, %d of them references\n",
                           level_names[level], summary->info.view_count[level], summary->levels[level].width,
                           summary->levels[level].height, degrees(summary->levels[level].fov_x),
                           degrees(summary->levels[level].fov_y), summary->levels[level].references);
    if (summary->levels[level].tiles)
        g_string_append_printf(text, "          %" PRIu64 " tiles, %.1f triangles each\n", summary->levels[level].tiles,
                               (double)summary->levels[level].triangles / (double)summary->levels[level].tiles);
}

/* Metres for people: what is under a micrometre is arithmetic. */
static double metres(double value)
{
    return fabs(value) < 1e-6 ? 0 : value;
}

static void field_text(GString *text, const struct lumi_field_summary *summary, const char *path)
{
    const struct lumi_field_info *info = &summary->info;
    static const int order[LUMI_LEVELS] = {LUMI_LEVEL_FINE, LUMI_LEVEL_COARSE};

    g_string_append_printf(text, "%s: light field, version %u\n", path, info->version);
    g_string_append_printf(text, "surface   %s, radius %.4g m, about (%.4g, %.4g, %.4g)\n",
                           surface_names[info->surface], info->radius, metres(info->centre.x), metres(info->centre.y),
                           metres(info->centre.z));
    g_string_append_printf(text, "disks     %s, %s kernel\nquality   %d\n", shape_names[info->disk_shape],
                           kernel_names[info->kernel], info->quality);
    for (int i = 0; i < LUMI_LEVELS; i++)
        put_level(text, summary, order[i]);
    g_string_append(text, "sizes\n");
    for (int i = 0; i < LUMI_LEVELS; i++) {
        int level = order[i];
        const char *name = level_names[level];
        const struct {
            const char *part;
            uint64_t bytes;
        } parts[] = {{"images", info->image_bytes[level]},
                     {"  of them references", info->reference_bytes[level]},
                     {"  of them side information", info->side_bytes[level]},
                     {"geometry", info->geometry_bytes[level]}};
        g_string_append_printf(text, " %s\n", name);
        for (size_t part = 0; part < G_N_ELEMENTS(parts); part++)
            put_size(text, parts[part].part, parts[part].bytes, info->file_bytes);
    }
    g_string_append(text, " both\n");
    put_size(text, "index", info->index_bytes, info->file_bytes);
    put_size(text, "all", info->file_bytes, info->file_bytes);
    put_factor(text, "compression, fine images", info->pixels[LUMI_LEVEL_FINE], info->image_bytes[LUMI_LEVEL_FINE]);
    put_factor(text, "compression, whole file", info->pixels[LUMI_LEVEL_FINE], info->file_bytes);
}

char *lumi_info_text(const struct lumi_info *info, const char *path)
{
    GString *text = g_string_new(NULL);

    if (info->is_field)
        field_text(text, &info->field, path);
    else
        capture_text(text, &info->capture, path);
    return g_string_free(text, FALSE);
}

static void capture_json(JsonBuilder *builder, const struct lumi_capture_summary *summary)
{
    const struct lumi_capture_info *info = &summary->info;

    lumi_put_int(builder, "version", (gint64)info->version);
    lumi_put_bool(builder, "sealed", info->sealed);
    lumi_put_string(builder, "title", summary->title);
    lumi_put_string(builder, "source", summary->source);
    lumi_put_string(builder, "created", summary->created);
    lumi_put_string(builder, "software", summary->software);
    lumi_put_string(builder, "surface", summary->surface);
    lumi_put_int(builder, "cameras", (gint64)info->cameras);
    lumi_put_int(builder, "lenses", (gint64)info->lenses);
    lumi_put_int(builder, "positions", (gint64)info->positions);
    lumi_put_int(builder, "shots", (gint64)info->shots);
    lumi_put_int(builder, "frames", (gint64)info->frames);
    lumi_put_object(builder, "states");
    for (int state = 0; state < 6; state++)
        lumi_put_int(builder, lumi_frame_state_name((enum lumi_frame_state)state), (gint64)info->in_state[state]);
    json_builder_end_object(builder);
    lumi_put_int(builder, "with_pose", (gint64)info->with_pose);
    lumi_put_object(builder, "poses");
    for (int source = LUMI_POSE_TRUE; source <= LUMI_POSE_IMPORTED; source++)
        lumi_put_int(builder, lumi_pose_source_name((enum lumi_pose_source)source),
                     (gint64)summary->in_pose_source[source]);
    json_builder_end_object(builder);
    lumi_put_int(builder, "width", (gint64)summary->width);
    lumi_put_int(builder, "height", (gint64)summary->height);
    lumi_put_int(builder, "pixels", (gint64)summary->pixels);
    lumi_put_object(builder, "bytes");
    lumi_put_int(builder, "images", (gint64)info->frame_bytes);
    lumi_put_int(builder, "index", (gint64)info->database_bytes);
    lumi_put_int(builder, "all", (gint64)summary->total_bytes);
    json_builder_end_object(builder);
    lumi_put_double(builder, "compression", ratio(summary->pixels * LUMI_INFO_RAW_BYTES, (uint64_t)info->frame_bytes));
}

static void level_json(JsonBuilder *builder, const struct lumi_field_summary *summary, int level)
{
    const struct lumi_field_info *info = &summary->info;

    lumi_put_object(builder, level_names[level]);
    lumi_put_int(builder, "views", (gint64)info->view_count[level]);
    lumi_put_int(builder, "references", (gint64)summary->levels[level].references);
    lumi_put_int(builder, "width", (gint64)summary->levels[level].width);
    lumi_put_int(builder, "height", (gint64)summary->levels[level].height);
    lumi_put_double(builder, "fov_x_degrees", degrees(summary->levels[level].fov_x));
    lumi_put_double(builder, "fov_y_degrees", degrees(summary->levels[level].fov_y));
    lumi_put_int(builder, "tiles", (gint64)summary->levels[level].tiles);
    lumi_put_int(builder, "vertices", (gint64)summary->levels[level].vertices);
    lumi_put_int(builder, "triangles", (gint64)summary->levels[level].triangles);
    lumi_put_int(builder, "pixels", (gint64)info->pixels[level]);
    lumi_put_object(builder, "bytes");
    lumi_put_int(builder, "images", (gint64)info->image_bytes[level]);
    lumi_put_int(builder, "references", (gint64)info->reference_bytes[level]);
    lumi_put_int(builder, "side", (gint64)info->side_bytes[level]);
    lumi_put_int(builder, "geometry", (gint64)info->geometry_bytes[level]);
    json_builder_end_object(builder);
    lumi_put_double(builder, "compression", ratio(info->pixels[level] * LUMI_INFO_RAW_BYTES, info->image_bytes[level]));
    json_builder_end_object(builder);
}

static void field_json(JsonBuilder *builder, const struct lumi_field_summary *summary)
{
    const struct lumi_field_info *info = &summary->info;

    lumi_put_int(builder, "version", (gint64)info->version);
    lumi_put_string(builder, "surface", surface_names[info->surface]);
    lumi_put_array(builder, "centre");
    json_builder_add_double_value(builder, info->centre.x);
    json_builder_add_double_value(builder, info->centre.y);
    json_builder_add_double_value(builder, info->centre.z);
    json_builder_end_array(builder);
    lumi_put_double(builder, "radius", info->radius);
    lumi_put_string(builder, "disks", shape_names[info->disk_shape]);
    lumi_put_string(builder, "kernel", kernel_names[info->kernel]);
    lumi_put_int(builder, "quality", (gint64)info->quality);
    for (int level = 0; level < LUMI_LEVELS; level++)
        level_json(builder, summary, level);
    lumi_put_object(builder, "bytes");
    lumi_put_int(builder, "index", (gint64)info->index_bytes);
    lumi_put_int(builder, "all", (gint64)info->file_bytes);
    json_builder_end_object(builder);
    lumi_put_double(builder, "compression",
                    ratio(info->pixels[LUMI_LEVEL_FINE] * LUMI_INFO_RAW_BYTES, info->file_bytes));
}

char *lumi_info_json(const struct lumi_info *info, const char *path)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    lumi_put_string(builder, "path", path);
    lumi_put_string(builder, "kind", info->is_field ? "field" : "capture");
    if (info->is_field)
        field_json(builder, &info->field);
    else
        capture_json(builder, &info->capture);
    return lumi_put_end(builder, FALSE);
}
