/* Building a place, and handing it to Embree. */
#include "sim/scene.h"

#include "proto/base/memory.h"
#include "sim/embree.h"

#include <assert.h>
#include <stdint.h>

int sim_scene_create(struct sim_scene **result, struct lumi_error *error)
{
    struct sim_scene *scene = lumi_calloc(1, sizeof *scene);

    *result = scene;
    if (!scene)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a scene");
    sim_scene_place(scene, v3(0, 0, 0), 0, 1);
    return LUMI_OK;
}

void sim_scene_destroy(struct sim_scene *scene)
{
    if (!scene)
        return;
    if (scene->tree)
        rtcReleaseScene(scene->tree);
    if (scene->device)
        rtcReleaseDevice(scene->device);
    lumi_free(scene->positions);
    lumi_free(scene->vertices);
    lumi_free(scene->triangles);
    lumi_free(scene->triangle_material);
    lumi_free(scene->light);
    lumi_free(scene->lit);
    lumi_free(scene);
}

int sim_scene_material(struct sim_scene *scene, const struct sim_material *material)
{
    assert(scene->material_count < SIM_MATERIALS);
    scene->materials[scene->material_count] = *material;
    return scene->material_count++;
}

void sim_scene_place(struct sim_scene *scene, struct sim_v3 origin, float yaw, float scale)
{
    float c = scale * cosf(yaw * (float)LUMI_PI / 180), s = scale * sinf(yaw * (float)LUMI_PI / 180);

    scene->frame = (struct sim_frame){v3(c, s, 0), v3(-s, c, 0), v3(0, 0, scale), origin};
}

void sim_scene_place_frame(struct sim_scene *scene, const struct sim_frame *frame)
{
    scene->frame = *frame;
}

static struct sim_v3 turn(const struct sim_frame *f, struct sim_v3 p)
{
    return v3_add(v3_scale(f->x, p.x), v3_add(v3_scale(f->y, p.y), v3_scale(f->z, p.z)));
}

struct sim_v3 sim_scene_point(const struct sim_scene *scene, struct sim_v3 local)
{
    return v3_add(scene->frame.origin, turn(&scene->frame, local));
}

/* Makes room for one more of both arrays; false and `failed` when memory is out. */
static bool grow(struct sim_scene *scene, void **first, size_t first_size, void **second, size_t second_size,
                 size_t *room)
{
    size_t wanted = *room ? 2 * *room : 4096;
    void *a = lumi_realloc(*first, wanted, first_size);

    if (a)
        *first = a;
    void *b = a ? lumi_realloc(*second, wanted, second_size) : NULL;
    if (b)
        *second = b;
    scene->failed = scene->failed || !a || !b;
    if (!scene->failed)
        *room = wanted;
    return !scene->failed;
}

unsigned sim_scene_vertex(struct sim_scene *scene, struct sim_v3 position, struct sim_v3 normal, struct sim_v3 at)
{
    if (scene->failed)
        return 0;
    /* Embree reads 16 bytes at each vertex, so the fourth float is there. */
    void *positions = scene->positions, *vertices = scene->vertices;
    if (scene->vertex_count == scene->vertex_room) {
        bool grown =
            grow(scene, &positions, sizeof *scene->positions, &vertices, sizeof *scene->vertices, &scene->vertex_room);
        scene->positions = positions;
        scene->vertices = vertices;
        if (!grown)
            return 0;
    }
    struct sim_v3 p = sim_scene_point(scene, position), n = v3_unit(turn(&scene->frame, normal));
    float *to = scene->positions[scene->vertex_count];
    to[0] = p.x;
    to[1] = p.y;
    to[2] = p.z;
    to[3] = 0;
    scene->vertices[scene->vertex_count] = (struct sim_vertex){n, at, p};
    return (unsigned)scene->vertex_count++;
}

void sim_scene_probe(struct sim_scene *scene, unsigned vertex, struct sim_v3 local)
{
    if (!scene->failed)
        scene->vertices[vertex].probe = sim_scene_point(scene, local);
}

void sim_scene_triangle(struct sim_scene *scene, unsigned a, unsigned b, unsigned c, int material)
{
    if (scene->failed)
        return;
    void *triangles = scene->triangles, *materials = scene->triangle_material;
    if (scene->triangle_count == scene->triangle_room) {
        bool grown = grow(scene, &triangles, sizeof *scene->triangles, &materials, 1, &scene->triangle_room);
        scene->triangles = triangles;
        scene->triangle_material = materials;
        if (!grown)
            return;
    }
    scene->triangles[scene->triangle_count] = (struct sim_triangle){a, b, c};
    scene->triangle_material[scene->triangle_count++] = (unsigned char)material;
}

void sim_scene_light(struct sim_scene *scene, struct sim_v3 origin, struct sim_v3 u, struct sim_v3 v, float gain)
{
    assert(scene->light_count < SIM_LIGHTS);
    scene->lights[scene->light_count++] =
        (struct sim_light){sim_scene_point(scene, origin), turn(&scene->frame, u), turn(&scene->frame, v), gain};
}

static int build_tree(struct sim_scene *scene, struct lumi_error *error)
{
    scene->device = rtcNewDevice(NULL);
    if (!scene->device)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "Embree cannot be started (error %d)", (int)rtcGetDeviceError(NULL));
    RTCGeometry mesh = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, scene->positions, 0,
                               sizeof *scene->positions, scene->vertex_count);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, scene->triangles, 0,
                               sizeof *scene->triangles, scene->triangle_count);
    rtcCommitGeometry(mesh);
    scene->tree = rtcNewScene(scene->device);
    /* Robust: no ray slips through the edge between two triangles. */
    rtcSetSceneFlags(scene->tree, RTC_SCENE_FLAG_ROBUST);
    rtcAttachGeometry(scene->tree, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(scene->tree);
    enum RTCError code = rtcGetDeviceError(scene->device);
    if (code != RTC_ERROR_NONE)
        return lumi_fail(error, code == RTC_ERROR_OUT_OF_MEMORY ? LUMI_ERR_NOMEM : LUMI_ERR_INTERNAL,
                         "Embree cannot build the scene (error %d)", (int)code);
    return LUMI_OK;
}

int sim_scene_commit(struct sim_scene *scene, struct lumi_error *error)
{
    if (!scene->failed) {
        scene->light = lumi_calloc(3 * scene->vertex_count, sizeof *scene->light);
        scene->lit = lumi_calloc(scene->vertex_count, sizeof *scene->lit);
    }
    if (scene->failed || !scene->light || !scene->lit)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the scene");
    return build_tree(scene, error);
}
