/* golden_dump field FILE.lumi | capture FOLDER | log FOLDER | compare A.png B.png: what a reader gets from a file, as
 * text that does not depend on the machine; how far two pictures are apart. */
#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"
#include "proto/lightfield/field.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Checksum of all pixels of a view as its tiles are decoded, in an order that goes forth and back. */
static int pixels_crc(struct lumi_tile_decoder *decoder, const struct lumi_grid *grid, int level, int view,
                      uint32_t *crc, struct lumi_error *error)
{
    struct lumi_tile_pixels pixels;
    int count = grid->cols * grid->rows;

    *crc = 0;
    for (int i = 0; i < 2 * count; i++) {
        int tile = i < count ? i : 2 * count - 1 - i;
        LUMI_TRY(lumi_field_decode_tile(decoder, level, view, tile % grid->cols, tile / grid->cols, &pixels, error));
        *crc = lumi_crc32c(*crc, pixels.y, sizeof pixels.y);
        *crc = lumi_crc32c(*crc, pixels.u, sizeof pixels.u);
        *crc = lumi_crc32c(*crc, pixels.v, sizeof pixels.v);
    }
    return LUMI_OK;
}

static uint32_t mesh_crc(const struct lumi_view_mesh *mesh, long *triangles)
{
    struct lumi_writer bytes;

    lumi_writer_init(&bytes);
    *triangles = 0;
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        lumi_write_u16(&bytes, tile->base);
        lumi_write_u8(&bytes, tile->shift);
        for (int k = 0; k < tile->vertex_count; k++) {
            lumi_write_u8(&bytes, tile->vertices[k].s);
            lumi_write_u8(&bytes, tile->vertices[k].t);
            lumi_write_u8(&bytes, tile->vertices[k].d);
        }
        for (int k = 0; k < 3 * tile->triangle_count; k++)
            lumi_write_u16(&bytes, tile->indices[k]);
        *triangles += tile->triangle_count;
    }
    uint32_t crc = lumi_crc32c(0, bytes.data, bytes.size);
    lumi_writer_finish(&bytes);
    return crc;
}

/* In short, for people, and all bits. */
static void print_pose(const struct lumi_pose *pose)
{
    const double numbers[12] = {pose->r[0], pose->r[1], pose->r[2], pose->r[3], pose->r[4], pose->r[5],
                                pose->r[6], pose->r[7], pose->r[8], pose->t.x,  pose->t.y,  pose->t.z};
    uint32_t crc = 0;

    for (int i = 0; i < 12; i++) {
        uint8_t bytes[8];
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        for (int k = 0; k < 8; k++)
            bytes[k] = (uint8_t)(bits >> (8 * k));
        crc = lumi_crc32c(crc, bytes, sizeof bytes);
    }
    printf(" at %.4g %.4g %.4g along %.4g %.4g %.4g, %08x", pose->t.x, pose->t.y, pose->t.z, pose->r[2], pose->r[5],
           pose->r[8], crc);
}

static int dump_view(struct lumi_tile_decoder *decoder, const struct lumi_field *field, int level, int index,
                     struct lumi_error *error)
{
    const struct lumi_field_view *view = lumi_field_view(field, level, index);
    const struct lumi_grid *grid = lumi_field_grid(field, view->grid);
    const struct lumi_view_mesh *mesh = lumi_field_mesh(field, level, index);
    long triangles;
    uint32_t pixels, geometry = mesh_crc(mesh, &triangles);

    LUMI_TRY(pixels_crc(decoder, grid, level, index, &pixels, error));
    if (index == 0 || view->grid != lumi_field_view(field, level, index - 1)->grid)
        printf("grid: %dx%d pixels, tangents %.9g to %.9g, %.9g to %.9g\n", grid->width, grid->height, grid->tan_x[0],
               grid->tan_x[grid->cols], grid->tan_y[0], grid->tan_y[grid->rows]);
    printf("view %d %d %s: reference %d, pixels %08x\n", level, index, view->name, view->reference, pixels);
    printf("  mesh: %ld triangles, %.9g + %.9g, %08x\n", triangles, (double)mesh->w_min, (double)mesh->w_step,
           geometry);
    printf("  disk: %.9g %.9g %.9g %.9g\n  pose:", (double)view->disk.u_neg, (double)view->disk.u_pos,
           (double)view->disk.v_neg, (double)view->disk.v_pos);
    print_pose(&view->pose);
    printf("\n");
    return LUMI_OK;
}

static int dump_field(const char *path, struct lumi_error *error)
{
    struct lumi_tile_decoder *decoder = NULL;
    struct lumi_field *field;
    int code;

    LUMI_TRY(lumi_field_open(path, 1, &field, error));
    const struct lumi_field_info *info = lumi_field_info(field);
    printf("version %u, surface %d, radius %.17g about %.17g %.17g %.17g, shape %d, kernel %d, quality %d\n",
           info->version, (int)info->surface, info->radius, info->centre.x, info->centre.y, info->centre.z,
           (int)info->disk_shape, (int)info->kernel, info->quality);
    code = lumi_tile_decoder_create(field, &decoder, error);
    for (int level = 0; level < LUMI_LEVELS; level++)
        for (int i = 0; code == LUMI_OK && i < info->view_count[level]; i++)
            code = dump_view(decoder, field, level, i, error);
    lumi_tile_decoder_destroy(decoder);
    lumi_field_close(field);
    return code;
}

static int dump_frame(struct lumi_capture *capture, const struct lumi_capture_frame *f, struct lumi_error *error)
{
    struct lumi_capture_lens lens;
    size_t exif_size;
    void *exif;

    LUMI_TRY(lumi_capture_lens(capture, f->lens_id, &lens, error));
    LUMI_TRY(lumi_capture_exif(capture, f->id, &exif, &exif_size, error));
    printf("frame %s '%s' %s: %s %dx%d, %lld bytes %s\n", f->name, f->original, f->camera_name,
           lumi_frame_state_name(f->state), f->width, f->height, (long long)f->bytes, f->sha256);
    printf("  file '%s', place %d %d, position %d, turn %d, shot %d, step %lld, angles %.17g %.17g\n", f->file, f->row,
           f->column, f->position, f->turn, f->shot, (long long)f->step, f->turn_angle, f->drop);
    printf("  exposure %+.17g, %.17g s, iso %.17g, sharpness %.17g, times %lld %lld, exif %zu %08x\n",
           f->exposure_offset, f->exposure_s, f->iso, f->sharpness, (long long)f->trigger_time_us,
           (long long)f->camera_time_us, exif_size, lumi_crc32c(0, exif, exif_size));
    printf("  lens %s %s (%d) %.17g %.17g %.17g %.17g, %.17g %.17g %.17g %.17g, %.17g %.17g, source's:", lens.name,
           f->lens_model, (int)f->lens.model, f->lens.fx, f->lens.fy, f->lens.cx, f->lens.cy, f->lens.k1, f->lens.k2,
           f->lens.k3, f->lens.k4, f->lens.p1, f->lens.p2);
    for (int i = 0; i < lens.parameter_count; i++)
        printf(" %.17g", lens.parameters[i]);
    printf("\n  pose: %s", f->has_pose ? lumi_pose_source_name(f->pose_source) : "none");
    if (f->has_pose)
        print_pose(&f->pose);
    printf("\n");
    lumi_free(exif);
    return LUMI_OK;
}

/* What version 2 added to frames. */
static void dump_fate(const struct lumi_capture_frame *f)
{
    const struct lumi_capture_judgement *j = &f->judgement;

    printf("frame %s: exposed %lld, shot %d of the plan, sweep %d, retake of %lld, reason '%s'\n", f->name,
           (long long)f->exposed_time_us, f->plan_shot, f->sweep, (long long)f->retake_of, f->reason);
    printf("  blur %.17g, clipped %.17g, dark %.17g, mean %.17g, exposure %.17g, shift %.17g, moved %.17g\n",
           j->blur_pixels, j->clipped, j->dark, j->mean, j->exposure_stops, j->shift_pixels, j->moved);
}

static int dump_cameras(struct lumi_capture *capture, struct lumi_error *error)
{
    struct lumi_capture_device device;
    struct lumi_capture_clock clock;
    char name[LUMI_CAPTURE_NAME];
    int64_t id;

    for (int i = 0; lumi_capture_camera(capture, i, &id, name, NULL) == LUMI_OK; i++) {
        LUMI_TRY(lumi_capture_get_device(capture, id, &device, error));
        printf("camera %s: '%s' '%s' '%s' '%s' '%s'\n", name, device.vendor, device.model, device.serial,
               device.firmware, device.address);
        if (lumi_capture_get_clock(capture, 0, id, &clock, NULL) == LUMI_OK)
            printf("  clock: %d frames, %.17g %.17g %.17g %.17g\n", clock.frames, clock.offset_s, clock.drift_ppm,
                   clock.residual_s, clock.worst_s);
    }
    return LUMI_OK;
}

static int dump_log(const char *path, struct lumi_error *error)
{
    struct lumi_capture_incident *incidents = NULL;
    struct lumi_capture_frame *frames = NULL;
    struct lumi_capture_sweep *sweeps = NULL;
    struct lumi_capture *capture;
    int count = 0, code;

    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    LUMI_GOTO(code, done, lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    for (int i = 0; i < count; i++)
        dump_fate(&frames[i]);
    LUMI_GOTO(code, done, dump_cameras(capture, error));
    LUMI_GOTO(code, done, lumi_capture_sweeps(capture, &sweeps, &count, error));
    for (int i = 0; i < count; i++)
        printf("sweep %d: %lld to %lld, '%s'\n", sweeps[i].number, (long long)sweeps[i].began_us,
               (long long)sweeps[i].ended_us, sweeps[i].outcome);
    LUMI_GOTO(code, done, lumi_capture_incidents(capture, &incidents, &count, error));
    for (int i = 0; i < count; i++)
        printf("incident %lld at %lld: %s, camera %lld, frame %lld, '%s'\n", (long long)incidents[i].id,
               (long long)incidents[i].time_us, incidents[i].kind, (long long)incidents[i].camera,
               (long long)incidents[i].frame, incidents[i].text);
done:
    lumi_free(incidents);
    lumi_free(sweeps);
    lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}

static int dump_capture(const char *path, struct lumi_error *error)
{
    struct lumi_capture_frame *frames = NULL;
    struct lumi_capture *capture;
    struct lumi_capture_info info;
    char *text = NULL;
    int count = 0, code;

    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    LUMI_GOTO(code, done, lumi_capture_info(capture, &info, error));
    printf("%d cameras, %d lenses, %d positions, %d shots, %d frames, %d with poses, %lld bytes\n", info.cameras,
           info.lenses, info.positions, info.shots, info.frames, info.with_pose, (long long)info.frame_bytes);
    LUMI_GOTO(code, done, lumi_capture_get_profile(capture, &text, error));
    printf("profile %zu %08x\n", strlen(text), lumi_crc32c(0, text, strlen(text)));
    lumi_free(text);
    text = NULL;
    LUMI_GOTO(code, done, lumi_capture_get_plan(capture, &text, error));
    printf("plan %s\n", text);
    LUMI_GOTO(code, done, lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    for (int i = 0; i < count; i++)
        LUMI_GOTO(code, done, dump_frame(capture, &frames[i], error));
done:
    lumi_free(text);
    lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}

static int compare(const char *a_path, const char *b_path, struct lumi_error *error)
{
    struct lumi_raster a = {0}, b = {0};
    int largest = 0, code;
    double sum = 0;

    LUMI_GOTO(code, done, lumi_image_read(a_path, 3, &a, NULL, error));
    LUMI_GOTO(code, done, lumi_image_read(b_path, 3, &b, NULL, error));
    if (a.width != b.width || a.height != b.height || a.sample != LUMI_U8 || b.sample != LUMI_U8)
        LUMI_GOTO(code, done, lumi_fail(error, LUMI_ERR_FORMAT, "%s: another size or depth than %s", b_path, a_path));
    for (int y = 0; y < a.height; y++)
        for (int x = 0; x < 3 * a.width; x++) {
            int difference = abs(lumi_row_u8(&a, y)[x] - lumi_row_u8(&b, y)[x]);
            largest = difference > largest ? difference : largest;
            sum += difference;
        }
    double mean = sum / (3.0 * a.width * a.height);
    if (mean > 0.05)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: differs from %s by %.3f on average, %d at most", b_path, a_path,
                         mean, largest);
done:
    lumi_raster_finish(&a);
    lumi_raster_finish(&b);
    return code;
}

int main(int argc, char **argv)
{
    struct lumi_error error = {0};
    int code = LUMI_ERR_ARG;

    if (argc == 3 && !strcmp(argv[1], "field"))
        code = dump_field(argv[2], &error);
    else if (argc == 3 && !strcmp(argv[1], "capture"))
        code = dump_capture(argv[2], &error);
    else if (argc == 3 && !strcmp(argv[1], "log"))
        code = dump_log(argv[2], &error);
    else if (argc == 4 && !strcmp(argv[1], "compare"))
        code = compare(argv[2], argv[3], &error);
    else
        lumi_fail(&error, code, "golden_dump field FILE.lumi | capture FOLDER | log FOLDER | compare A.png B.png");
    if (code != LUMI_OK)
        fprintf(stderr, "golden_dump: %s\n", error.text);
    return lumi_exit_status(code);
}
