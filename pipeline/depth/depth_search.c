/* Which planes are searched where. A search at half the size knows nearly everything about the depths around a place;
 * only what it finds in and around a block is tried again. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

enum { HALF = MVS_BLOCK / 2 }; /* a block, at half the size */
enum { AROUND = 4 };           /* pixels of the half size around a block that have a say in it */
#define MARGIN 1.5             /* planes of the half size around a choice */

static int search_init(struct mvs_search *search, int width, int height)
{
    memset(search, 0, sizeof(*search));
    search->columns = (width + MVS_BLOCK - 1) / MVS_BLOCK;
    search->rows = (height + MVS_BLOCK - 1) / MVS_BLOCK;
    search->blocks = lumi_calloc((size_t)search->columns * (size_t)search->rows, sizeof(*search->blocks));
    return search->blocks ? LUMI_OK : LUMI_ERR_NOMEM;
}

void mvs_search_finish(struct mvs_search *search)
{
    lumi_free(search->blocks);
    memset(search, 0, sizeof(*search));
}

int mvs_groups(uint32_t bits, uint8_t groups[MVS_GROUPS_MAX])
{
    int count = 0;

    for (int g = 0; g < MVS_GROUPS_MAX; g++)
        if (bits >> g & 1)
            groups[count++] = (uint8_t)g;
    return count;
}

/* An even number of groups: one more next to those there are, nearer ones first. */
static uint32_t make_even(uint32_t bits, int groups)
{
    const uint32_t all = (uint32_t)((UINT64_C(1) << groups) - 1);
    uint8_t list[MVS_GROUPS_MAX];

    if (!bits)
        bits = 1;
    if (mvs_groups(bits, list) % 2 == 0)
        return bits;
    uint32_t nearer = bits << 1 & ~bits & all, farther = bits >> 1 & ~bits;
    uint32_t more = nearer ? nearer : farther;
    return bits | (more & (0 - more));
}

/* Lays the volume out. */
static void lay_out(struct mvs_search *search, int groups)
{
    size_t at = 0;

    for (int r = 0; r < search->rows; r++) {
        int column = 0;
        for (int c = 0; c < search->columns; c++) {
            struct mvs_block *block = search->blocks + (size_t)r * (size_t)search->columns + c;
            uint8_t list[MVS_GROUPS_MAX];
            block->groups = make_even(block->groups, groups);
            block->lanes = MVS_GROUP * mvs_groups(block->groups, list);
            block->column = column;
            block->at = at;
            column += block->lanes;
            at += (size_t)block->lanes * MVS_BLOCK * MVS_BLOCK;
        }
        search->widest = column > search->widest ? column : search->widest;
    }
    search->size = at;
}

int mvs_search_all(struct mvs_search *search, int width, int height, int planes)
{
    const int groups = planes / MVS_GROUP;

    LUMI_TRY(search_init(search, width, height));
    for (int i = 0; i < search->columns * search->rows; i++)
        search->blocks[i].groups = (uint32_t)((UINT64_C(1) << groups) - 1);
    lay_out(search, groups);
    return LUMI_OK;
}

/* Groups of the planes within `margin` of a place. */
static uint32_t groups_around(double plane, double margin, int planes)
{
    const int low = (int)fmax(plane - margin, 0) / MVS_GROUP;
    const int high = (int)fmin(fmax(plane + margin, 0), planes - 1) / MVS_GROUP;
    uint32_t bits = 0;

    for (int g = low < high ? low : high; g <= high; g++)
        bits |= UINT32_C(1) << g;
    return bits;
}

int mvs_search_from(struct mvs_search *search, int width, int height, const struct mvs_planes *planes,
                    const struct mvs_level *half)
{
    const double ratio = half->planes.step / planes->step, margin = MARGIN * ratio;
    const double first = (half->planes.first - planes->first) / planes->step;

    LUMI_TRY(search_init(search, width, height));
    for (int r = 0; r < search->rows; r++)
        for (int c = 0; c < search->columns; c++) {
            const int left = HALF * c - AROUND, right = HALF * (c + 1) + AROUND;
            const int top = HALF * r - AROUND, bottom = HALF * (r + 1) + AROUND;
            uint32_t bits = 0;
            for (int y = top > 0 ? top : 0; y < bottom && y < half->height; y++)
                for (int x = left > 0 ? left : 0; x < right && x < half->width; x++)
                    bits |= groups_around(first + ratio * half->chosen[(size_t)y * (size_t)half->width + (size_t)x],
                                          margin, planes->count);
            search->blocks[(size_t)r * (size_t)search->columns + (size_t)c].groups = bits;
        }
    lay_out(search, planes->count / MVS_GROUP);
    return LUMI_OK;
}
