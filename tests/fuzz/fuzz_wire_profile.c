/* Profiles (first byte even) and plans (odd) off the wire: what the structs take comes back the same, number for
 * number; a rig or plan that is sound goes through its text form as well. */
#include "checks.h"

#include "proto/wire/message.h"

static lumi_wire_Profile scratch;
static struct lumi_rig rig, back;
static uint8_t once[LUMI_WIRE_PROFILE_MAX + 64], twice[LUMI_WIRE_PROFILE_MAX + 64];

static void same(const struct lumi_rig *other, size_t length)
{
    if (lumi_wire_encode_profile(other, &scratch, twice, sizeof twice) != length || memcmp(once, twice, length) != 0)
        abort();
}

static void profile(const uint8_t *data, size_t size)
{
    static char text[LUMI_RIG_TEXT_MAX];
    struct lumi_error error = {0};

    if (checked(lumi_wire_decode_profile(data, size, &scratch, &rig, &error), &error) != LUMI_OK)
        return;
    size_t length = lumi_wire_encode_profile(&rig, &scratch, once, sizeof once);
    if (length == 0 || lumi_wire_decode_profile(once, length, &scratch, &back, NULL) != LUMI_OK)
        abort();
    same(&back, length);
    if (checked(lumi_rig_check(&rig, &error), &error) != LUMI_OK)
        return;
    size_t printed = lumi_rig_print(&rig, text, sizeof text);
    if (printed >= sizeof text || lumi_rig_parse(text, printed, "fuzz", &back, NULL) != LUMI_OK)
        abort();
    same(&back, length);
}

static void plan(const uint8_t *data, size_t size)
{
    static lumi_wire_HostFrame message;
    struct lumi_error error = {0};
    struct lumi_plan sweep, other;
    lumi_wire_Plan again;

    if (!lumi_wire_decode_host(data, size, &message) || message.which_body != lumi_wire_HostFrame_request_tag ||
        message.body.request.which_command != lumi_wire_Request_load_plan_tag)
        return;
    if (checked(lumi_wire_to_plan(&message.body.request.command.load_plan.plan, &sweep, &error), &error) != LUMI_OK)
        return;
    lumi_wire_from_plan(&sweep, &again);
    if (lumi_wire_to_plan(&again, &other, NULL) != LUMI_OK || lumi_wire_plan_crc(&sweep) != lumi_wire_plan_crc(&other))
        abort();
    if (lumi_rig_builtin("arc16", &rig, NULL) == LUMI_OK)
        checked(lumi_plan_check(&sweep, &rig, &error), &error);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    if (data[0] & 1)
        plan(data + 1, size - 1);
    else
        profile(data + 1, size - 1);
    return 0;
}
