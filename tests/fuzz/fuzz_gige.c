/* What comes from a camera network: answers to a discovery; and what a simulated camera is asked. The first byte says
 * which; requests follow each other, a byte of length before each. */
#include "checks.h"

#include "sim/gige/gige_control.h"
#ifdef FUZZ_ARAVIS
#include "daemon/camera/camera_aravis_priv.h"

static void discovery(const uint8_t *data, size_t size)
{
    struct lumi_camera_identity identity;

    if (!aravis_discovery_parse(data, size, &identity))
        return;
    if (!identity.serial[0] || strlen(identity.serial) > 16 || strlen(identity.vendor) > 32 ||
        strlen(identity.model) > 32)
        abort();
}
#endif

static void requests(const uint8_t *data, size_t size)
{
    static const struct gige_identity identity = {"127.0.0.9", "V", "M", "1", "S9", "n", 64, 48, 125000000};
    static struct gige_control control;
    uint8_t answer[GIGE_PACKET_MAX];
    uint64_t now = 0;

    memset(&control, 0, sizeof control);
    if (gige_registers_init(&control.registers, &identity) != LUMI_OK)
        abort();
    for (size_t at = 0; at < size; now += 400000000) {
        size_t length = data[at++];
        length = length < size - at ? length : size - at;
        const struct gige_peer peer = {0x7f000001, (uint16_t)(5000 + length % 2)};
        const size_t made = gige_control_answer(&control, &peer, now, data + at, length, answer);
        if (made > GIGE_PACKET_MAX || (made > 0 && made < 8) || gige_get(&control.registers, GIGE_WIDTH) - 1 > 63 ||
            !gige_format_known(gige_get(&control.registers, GIGE_PIXEL_FORMAT)))
            abort();
        gige_control_expire(&control, now);
        at += length;
    }
    gige_registers_finish(&control.registers);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
#ifdef FUZZ_ARAVIS
    if (data[0] & 1) {
        discovery(data + 1, size - 1);
        return 0;
    }
#endif
    requests(data + 1, size - 1);
    return 0;
}
