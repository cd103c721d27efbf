/* The cameras' pictures: frames that come go to daemon/preview; while nothing is under way, cameras that somebody
 * watches are asked for some. */
#include "daemon/lumid/service_priv.h"

#include <stdio.h>

#define LOOK_NS 500000000 /* from one to the next */

int lumi_service_pictures_start(struct lumi_service *service, struct lumi_error *error)
{
    const struct lumi_config *config = service->config;
    struct lumi_pictures_options options;

    lumi_pictures_options_init(&options);
    options.cameras = config->engine.camera_count;
    for (int c = 0; c < options.cameras; c++)
        snprintf(options.names[c], sizeof options.names[c], "%s", config->engine.cameras[c].name);
    return lumi_pictures_create(&options, &service->pictures, error);
}

void lumi_service_picture(void *context, const struct lumi_engine_picture *picture)
{
    struct lumi_service *service = context;
    const struct lumi_picture_offer offer = {.camera = picture->camera,
                                             .frame = picture->frame,
                                             .name = picture->name,
                                             .shot = picture->shot,
                                             .unix_us = picture->unix_us,
                                             .white = {picture->white[0], picture->white[1]},
                                             .spare = picture->spare};

    lumi_pictures_offer(service->pictures, lumi_service_now(), &offer);
}

void lumi_service_pictures_tick(struct lumi_service *service, int64_t now)
{
    struct lumi_error error;

    for (int c = 0; c < service->config->engine.camera_count; c++)
        if (service->looked & 1u << c && lumi_pictures_watchers(service->pictures, c) == 0) {
            service->looked &= ~(1u << c);
            lumi_engine_look_end(service->engine, now, c);
        }
    if (now - service->look_ns < LOOK_NS || service->ending)
        return;
    service->look_ns = now;
    for (int c = 0; c < service->config->engine.camera_count; c++)
        if (lumi_pictures_watchers(service->pictures, c) > 0 &&
            lumi_engine_look(service->engine, now, c, &error) == LUMI_OK)
            service->looked |= 1u << c;
}
