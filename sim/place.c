/* The list of places. */
#include "sim/place.h"

#include "sim/tripod.h"

#include <string.h>

const struct sim_place *const sim_places[] = {&sim_room, &sim_court, &sim_object, NULL};

/* A radius of 0: no stand. */
static int open_place(const char *name, double radius, bool seen, struct sim_scene **result, struct lumi_error *error)
{
    const struct sim_place *place = NULL;
    struct sim_scene *scene;

    *result = NULL;
    for (int i = 0; sim_places[i]; i++)
        if (!strcmp(sim_places[i]->name, name))
            place = sim_places[i];
    if (!place)
        return lumi_fail(error, LUMI_ERR_ARG, "no place '%s': room, court and object there are", name);
    LUMI_TRY(sim_scene_create(&scene, error));
    place->build(scene);
    if (radius > 0) {
        scene->unseen = seen ? 0 : scene->triangle_count;
        sim_stand_add(scene, radius);
    }
    int code = sim_scene_commit(scene, error);
    if (code == LUMI_OK)
        *result = scene;
    else
        sim_scene_destroy(scene);
    return code;
}

int sim_place_open(const char *name, struct sim_scene **result, struct lumi_error *error)
{
    return open_place(name, 0, true, result, error);
}

int sim_place_open_stand(const char *name, double radius, bool seen, struct sim_scene **result,
                         struct lumi_error *error)
{
    return open_place(name, radius, seen, result, error);
}
