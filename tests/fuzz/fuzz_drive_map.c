/* The parser of drives' register maps. What it takes must be within what Modbus and the drive's code can hold. */
#include "checks.h"

#include "daemon/rig/drive_map.h"

#include <math.h>

static void hold_register(const struct lumi_drive_register *reg)
{
    if (reg->address < 0 || reg->address + reg->width / 16 > 65536 || (reg->width != 16 && reg->width != 32) ||
        !isfinite(reg->multiplier) || reg->multiplier == 0)
        abort();
}

static void hold_command(const struct lumi_drive_command *command)
{
    if (command->address < 0 || command->address > 65535 || command->value < 0 || command->value > 65535 ||
        command->clear < -1 || command->clear > 65535)
        abort();
}

static void hold_bit(const struct lumi_drive_bit *bit, int width)
{
    if (bit->used && (bit->bit < 0 || bit->bit >= width))
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_drive_map map;

    if (checked(lumi_drive_map_parse((const char *)data, size, "fuzz", &map, &error), &error) != LUMI_OK)
        return 0;
    hold_register(&map.status);
    hold_register(&map.position);
    hold_register(&map.fault_code);
    hold_register(&map.target);
    hold_register(&map.speed);
    hold_command(&map.start);
    hold_command(&map.stop);
    hold_command(&map.reset);
    hold_command(&map.home);
    hold_bit(&map.enabled, map.status.width);
    hold_bit(&map.ready, map.status.width);
    hold_bit(&map.reached, map.status.width);
    hold_bit(&map.fault, map.status.width);
    hold_bit(&map.homed, map.status.width);
    if (map.unit < 1 || map.unit > 247 || !(map.timeout > 0) || map.retries < 0 || !isfinite(map.counts_per_turn) ||
        map.counts_per_turn == 0 || !map.name[0])
        abort();
    return 0;
}
