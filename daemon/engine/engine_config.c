/* What an engine does unless told otherwise. */
#include "daemon/engine/engine.h"

void lumi_engine_config_init(struct lumi_engine_config *config)
{
    *config = (struct lumi_engine_config){.judging = true,
                                          .retakes = 3,
                                          .frame_patience = 5,
                                          .disk_reserve = 0.05,
                                          .battery_least = 0.2,
                                          .temperature_most = 70,
                                          .rig_patience = 60,
                                          .verify = true};
    lumi_judge_limits_init(&config->judge);
    lumi_store_options_init(&config->store);
}
