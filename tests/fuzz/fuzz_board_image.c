/* The check of firmware images before they are written to a board; and the lines of a sweep's log, read again. */
#include "checks.h"

#include "daemon/rig/flash.h"
#include "daemon/rig/sweep_log.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct board_image image;
    struct lumi_rig_log_line line;

    if (checked(lumi_rig_image_check(data, size, "fuzz", NULL, &image, &error), &error) == LUMI_OK &&
        (image.size != size || strlen(image.board) >= sizeof image.board ||
         strlen(image.firmware) >= sizeof image.firmware))
        abort();
    lumi_rig_log_line_parse((const char *)data, size, &line);
    if (line.has_shot && line.shot >= LUMI_PLAN_SHOTS_MAX)
        abort();
    return 0;
}
