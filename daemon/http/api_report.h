/* What the engine knows, as the API says it: objects of openapi.json by the same names. */
#ifndef LUMI_DAEMON_HTTP_API_REPORT_H
#define LUMI_DAEMON_HTTP_API_REPORT_H

#include "daemon/engine/engine.h"
#include "daemon/handover/handover.h"
#include "daemon/http/api_json.h"

/* Each adds the members of an object that is open. */
void lumi_api_capture(JsonBuilder *builder, const struct lumi_engine_status *status);
void lumi_api_checks(JsonBuilder *builder, const struct lumi_engine_status *status); /* "checks": [Check] */
void lumi_api_check(JsonBuilder *builder, const struct lumi_engine_check *check);
void lumi_api_status(JsonBuilder *builder, const struct lumi_engine_status *status);
void lumi_api_identity(JsonBuilder *builder, const struct lumi_camera_identity *identity);
void lumi_api_missing(JsonBuilder *builder, const struct lumi_engine_missing *missing);
void lumi_api_processing(JsonBuilder *builder, const struct lumi_process_status *status);
void lumi_api_ingest(JsonBuilder *builder, const struct lumi_ingest_status *status);
void lumi_api_board(JsonBuilder *builder, const struct lumi_rig_usb_board *board);

/* (transfer full) The same numbers for Prometheus: text format 0.0.4. */
char *lumi_api_metrics(const struct lumi_engine_status *status);

#endif
