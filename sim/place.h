/* The places that can be photographed, by name. All of them leave a ball of 0.45 m about the origin free. */
#ifndef LUMI_SIM_PLACE_H
#define LUMI_SIM_PLACE_H

#include "sim/scene.h"

struct sim_place {
    const char *name, *summary;
    void (*build)(struct sim_scene *scene);
};

extern const struct sim_place sim_room, sim_court, sim_object;
extern const struct sim_place *const sim_places[]; /* ends with NULL */

/* Builds a place; release with sim_scene_destroy. LUMI_ERR_ARG lists the names when there is none of this one. */
int sim_place_open(const char *name, struct sim_scene **scene, struct lumi_error *error);
/* The same with a tripod under cameras on a sphere of this radius (sim/tripod.h); not `seen`: it casts its shadow, but
 * no camera sees it itself, only reflections of it. */
int sim_place_open_stand(const char *name, double radius, bool seen, struct sim_scene **scene,
                         struct lumi_error *error);

#endif
