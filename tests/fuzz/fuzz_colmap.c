/* A COLMAP model from memory. The first byte's lowest bit: binary or text; the next two: the bytes of the cameras; then
 * cameras and images. */
#include "checks.h"

#include "pipeline/exchange/exchange.h"

static void check(const struct lumi_exchange *list)
{
    for (guint i = 0; i < list->images->len; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(list, (int)i);
        struct lumi_lens lens;
        if (!image->original || image->camera < 0 || image->camera >= (int)list->cameras->len ||
            !lumi_pose_valid(&image->pose, 1e-3) ||
            lumi_exchange_lens(lumi_exchange_camera(list, image->camera), "fuzz", &lens, NULL) != LUMI_OK)
            abort();
    }
}

/* Written and read again, it must be accepted and as long. */
static void write_and_read(const struct lumi_exchange *list, bool binary)
{
    g_autoptr(GByteArray) cameras = g_byte_array_new();
    g_autoptr(GByteArray) images = g_byte_array_new();
    g_autoptr(GHashTable) table = g_hash_table_new(NULL, NULL);
    struct lumi_exchange again;

    lumi_exchange_init(&again);
    lumi_exchange_format_colmap_cameras(list, binary, cameras);
    lumi_exchange_format_colmap_images(list, binary, images);
    if (lumi_exchange_parse_colmap_cameras(cameras->data, cameras->len, binary, "fuzz", table, &again, NULL) ||
        lumi_exchange_parse_colmap_images(images->data, images->len, binary, "fuzz", table, &again, NULL) ||
        again.images->len != list->images->len)
        abort();
    lumi_exchange_finish(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    g_autoptr(GHashTable) table = g_hash_table_new(NULL, NULL);
    struct lumi_error error = {0};
    struct lumi_exchange list;

    if (size < 3)
        return 0;
    bool binary = data[0] & 1;
    size_t split = (size_t)data[1] + ((size_t)data[2] << 8);
    split = split < size - 3 ? split : size - 3;
    lumi_exchange_init(&list);
    int code = lumi_exchange_parse_colmap_cameras(data + 3, split, binary, "fuzz", table, &list, &error);
    if (code == LUMI_OK)
        code =
            lumi_exchange_parse_colmap_images(data + 3 + split, size - 3 - split, binary, "fuzz", table, &list, &error);
    if (checked(code, &error) == LUMI_OK) {
        check(&list);
        write_and_read(&list, true);
    }
    lumi_exchange_finish(&list);
    return 0;
}
