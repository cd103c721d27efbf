/* Depth maps against the room of the stand. */
#include "pipeline/synthesize/stand_mask.h"

#include "proto/base/memory.h"
#include "proto/base/result.h"

#include <string.h>

#define FLOOR_STEP 0.01 /* metres a bin */
enum { FLOOR_WINDOW = 3, FLOOR_AROUND = 10 };
/* Depth is not exact: what is lower than this above the floor belongs to it. */
#define FLOOR_MARGIN 0.025

/* Nearer than this nothing is matched: depth there is anything. */
#define TOO_NEAR 0.3
#define BELOW 0.15 /* of the height, which no depth is wrong by */

void lumi_floor_init(struct lumi_floor *floor, double top)
{
    *floor = (struct lumi_floor){.top = top, .step = FLOOR_STEP};
}

static bool point_at(const struct lumi_grid *grid, const struct lumi_pose *pose, const struct lumi_raster *depth, int x,
                     int y, struct lumi_vec3 *point)
{
    const double w = lumi_row_f32(depth, y)[x];
    double tan_x, tan_y;

    if (!(w > 1e-3))
        return false;
    lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
    *point = lumi_to_world(pose, lumi_vec3(tan_x / w, tan_y / w, 1 / w));
    return true;
}

void lumi_floor_add(struct lumi_floor *floor, const struct lumi_grid *grid, const struct lumi_pose *pose,
                    const struct lumi_raster *depth, struct lumi_vec3 centre, double reach)
{
    for (int y = 0; y < grid->height; y += 2)
        for (int x = 0; x < grid->width; x += 2) {
            struct lumi_vec3 p;
            if (!point_at(grid, pose, depth, x, y, &p) || hypot(p.x - centre.x, p.y - centre.y) > reach)
                continue;
            const double bin = (floor->top - p.z) / floor->step;
            if (bin >= 0 && bin < LUMI_FLOOR_BINS) {
                const struct lumi_vec3 d = lumi_sub(p, pose->t);
                floor->area[(int)bin] += lumi_dot(d, d);
            }
        }
}

static double within(const struct lumi_floor *floor, int bin, int around)
{
    double sum = 0;

    for (int i = bin - around; i <= bin + around; i++)
        if (i >= 0 && i < LUMI_FLOOR_BINS)
            sum += floor->area[i];
    return sum;
}

bool lumi_floor_find(const struct lumi_floor *floor, double *height)
{
    double total = 0, best = 0, sum = 0, moment = 0;
    int at = 0;

    for (int i = 0; i < LUMI_FLOOR_BINS; i++) {
        const double here = within(floor, i, FLOOR_WINDOW);
        total += floor->area[i];
        if (here > best) {
            best = here;
            at = i;
        }
    }
    for (int i = at - FLOOR_WINDOW; i <= at + FLOOR_WINDOW; i++)
        if (i >= 0 && i < LUMI_FLOOR_BINS) {
            sum += floor->area[i];
            moment += floor->area[i] * (i + 0.5);
        }
    if (!(total > 0) || within(floor, at, FLOOR_AROUND) < 0.25 * total)
        return false;
    *height = floor->top - floor->step * moment / sum;
    return true;
}

/* Whether a ray comes into the upright cylinder about the axis, from `bottom` to `top`, before depth could tell what is
 * there. */
static bool enters_near(const struct lumi_stand *stand, double radius, double top, struct lumi_vec3 eye,
                        struct lumi_vec3 ray)
{
    const double x = eye.x - stand->centre.x, y = eye.y - stand->centre.y, length = lumi_length(ray);
    const double a = ray.x * ray.x + ray.y * ray.y, b = x * ray.x + y * ray.y;
    const double inside = b * b - a * (x * x + y * y - radius * radius), down = (top - eye.z) / ray.z;

    if (eye.z > top && ray.z < 0 && down * length < TOO_NEAR && hypot(x + down * ray.x, y + down * ray.y) < radius)
        return true;
    if (b >= 0 || inside < 0)
        return false;
    const double t = (-b - sqrt(inside)) / a, z = eye.z + t * ray.z;
    return t * length < TOO_NEAR && z < top && z > stand->bottom + FLOOR_MARGIN;
}

static bool enters_head(const struct lumi_stand *stand, struct lumi_vec3 eye, struct lumi_vec3 ray)
{
    return enters_near(stand, stand->head, stand->top - LUMI_STAND_CLEAR, eye, ray);
}

/* What such a ray shows lies farther below the floor than depth is wrong by. */
static bool below_floor(const struct lumi_stand *stand, struct lumi_vec3 eye, struct lumi_vec3 point)
{
    return point.z < stand->bottom - BELOW * (eye.z - stand->bottom);
}

double lumi_stand_share(const struct lumi_stand *stand, const struct lumi_grid *grid, const struct lumi_pose *pose,
                        const struct lumi_raster *depth)
{
    /* Nothing else comes as near to the axis as the cameras' circle: the upper half of the way is enough to tell. */
    const double low = (stand->top + stand->bottom) / 2;
    long found = 0, all = 0, near = 0, below = 0;

    for (int y = 0; y < grid->height; y += 2)
        for (int x = 0; x < grid->width; x += 2, all++) {
            struct lumi_vec3 p;
            if (!point_at(grid, pose, depth, x, y, &p))
                continue;
            if (p.z > low && p.z < stand->centre.z &&
                hypot(p.x - stand->centre.x, p.y - stand->centre.y) < stand->narrow)
                found++;
            else if (enters_head(stand, pose->t, lumi_sub(p, pose->t))) {
                near++;
                below += below_floor(stand, pose->t, p);
            }
        }
    /* Nobody sees through the floor: there is something too near to be matched. */
    return (double)(found + (3 * below > near ? below : 0)) / (double)all;
}

static bool blocks(const struct lumi_stand *stand, const struct lumi_grid *grid, const struct lumi_pose *pose,
                   const struct lumi_raster *depth, int x, int y)
{
    struct lumi_vec3 point;
    double tan_x, tan_y;

    if (point_at(grid, pose, depth, x, y, &point) && lumi_stand_holds(stand, point, FLOOR_MARGIN))
        return true;
    lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
    const struct lumi_vec3 ray = lumi_rotate(pose->r, lumi_vec3(tan_x, tan_y, 1));
    return enters_near(stand, stand->narrow, stand->centre.z, pose->t, ray) || enters_head(stand, pose->t, ray);
}

long lumi_stand_mask(const struct lumi_stand *stand, const struct lumi_grid *grid, const struct lumi_pose *pose,
                     const struct lumi_raster *depth, uint8_t *blocked)
{
    long count = 0;

    for (int y = 0; y < grid->height; y++)
        for (int x = 0; x < grid->width; x++) {
            if (!blocks(stand, grid, pose, depth, x, y))
                continue;
            blocked[(size_t)y * (size_t)grid->width + (size_t)x] = 1;
            count++;
        }
    return count;
}

/* A line of `count` bytes `step` apart. */
static void widen_line(uint8_t *line, size_t step, int count, int reach, uint8_t *scratch)
{
    int last = -reach - 1;

    for (int i = 0; i < count; i++)
        scratch[i] = line[(size_t)i * step];
    for (int i = 0; i < count; i++) {
        last = scratch[i] ? i : last;
        if (i - last <= reach)
            line[(size_t)i * step] = 1;
    }
    last = count + reach;
    for (int i = count - 1; i >= 0; i--) {
        last = scratch[i] ? i : last;
        if (last - i <= reach)
            line[(size_t)i * step] = 1;
    }
}

int lumi_mask_widen(uint8_t *blocked, int width, int height, int reach)
{
    uint8_t *scratch = lumi_alloc((size_t)(width > height ? width : height), 1);

    if (!scratch)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < height; y++)
        widen_line(blocked + (size_t)y * (size_t)width, 1, width, reach, scratch);
    for (int x = 0; x < width; x++)
        widen_line(blocked + x, (size_t)width, height, reach, scratch);
    lumi_free(scratch);
    return LUMI_OK;
}
