/* A capture's database brought up to date with its log: how far the log goes is told by numbers in it. The input is a
 * byte, the database in units of 512 bytes, the log. */
#include "checks.h"

#include "proto/capture/capture_priv.h"

static void apply(const uint8_t *data, size_t size)
{
    size_t db_size = (size_t)data[0] * 512 < size - 1 ? (size_t)data[0] * 512 : size - 1, room = db_size;
    uint8_t *db = lumi_alloc(db_size ? db_size : 1, 1);
    struct lumi_capture *capture;
    struct lumi_error error = {0};

    if (!db)
        return;
    memcpy(db, data + 1, db_size);
    if (capture_apply_log(&db, &room, data + 1 + db_size, size - 1 - db_size) == LUMI_OK && room > 100) {
        db[18] = db[19] = 1;
        if (checked(lumi_capture_open_memory(db, room, "fuzz", &capture, &error), &error) == LUMI_OK)
            lumi_capture_close(capture);
    }
    lumi_free(db);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2 || size > 1 << 20)
        return 0;
    with_and_without_memory(data, size, apply);
    return 0;
}
