/* The parser of rig profiles. What it takes must be printable, parse again to the same numbers, and give poses. */
#include "checks.h"

#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/rig.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char text[LUMI_RIG_TEXT_MAX];
    struct lumi_error error = {0};
    struct lumi_rig rig, back;
    struct lumi_pose pose;

    if (checked(lumi_rig_parse((const char *)data, size, "fuzz", &rig, &error), &error) != LUMI_OK)
        return 0;
    size_t length = lumi_rig_print(&rig, text, sizeof text);
    if (length >= sizeof text || lumi_rig_parse(text, length, "fuzz", &back, NULL) != LUMI_OK ||
        memcmp(&rig, &back, sizeof rig) != 0)
        abort();
    for (int c = 0; c < rig.camera_count; c++) {
        lumi_rig_camera_pose(&rig, c, rig.turns * 0.7, &pose);
        if (!lumi_pose_valid(&pose, 1e-6))
            abort();
    }
    return 0;
}
