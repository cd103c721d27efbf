/* Finding what stays in a camera's pictures. */
#include "pipeline/calibrate/mask_find.h"

#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <math.h>
#include <string.h>

enum { FRAMES_MAX = 64, BEYOND = 2 };
#define STILL 5.0f       /* grey levels: what stays changes less, mostly */
#define STANDS_OUT 10.0f /* grey levels between an outline's two sides */
#define OUTLINE 0.55     /* share of outline and pictures in which it stands out */
#define SMALLEST 0.0015  /* share of the picture */

int lumi_mask_across(const struct lumi_mask *mask)
{
    return (mask->width + mask->block - 1) / mask->block;
}

int lumi_mask_down(const struct lumi_mask *mask)
{
    return (mask->height + mask->block - 1) / mask->block;
}

/* The distance from the usual value that four pictures in five keep: where the world is still in fewer, its edges are
 * what makes the outline, and these stand out in few. */
static float change_of(const float *const *pictures, int count, int at)
{
    float values[FRAMES_MAX];

    for (int i = 0; i < count; i++)
        values[i] = pictures[i][at];
    lumi_sort_floats(values, count);
    const float middle = values[count / 2];
    for (int i = 0; i < count; i++)
        values[i] = fabsf(values[i] - middle);
    lumi_sort_floats(values, count);
    return values[count * 4 / 5];
}

/* The regions of what is still: marks one with `mark` from `from`, by a stack; returns its size. */
static int flood(uint8_t *marks, int width, int height, int from, uint8_t mark, int *stack)
{
    int top = 0, size = 0;

    stack[top++] = from;
    marks[from] = mark;
    while (top > 0) {
        const int at = stack[--top], x = at % width, y = at / width;
        const int next[4] = {x > 0 ? at - 1 : -1, x + 1 < width ? at + 1 : -1, y > 0 ? at - width : -1,
                             y + 1 < height ? at + width : -1};
        size++;
        for (int i = 0; i < 4; i++)
            if (next[i] >= 0 && marks[next[i]] == 1) {
                marks[next[i]] = mark;
                stack[top++] = next[i];
            }
    }
    return size;
}

/* In how many of the pictures the outline of the marked region stands out, of all its places together. */
static double outline(const float *const *pictures, int count, int width, int height, const uint8_t *marks,
                      uint8_t mark)
{
    static const int steps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    long places = 0, stands = 0;

    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int s = 0; s < 4 && marks[y * width + x] == mark; s++) {
                const int a = x + steps[s][0], b = y + steps[s][1], c = x + BEYOND * steps[s][0],
                          d = y + BEYOND * steps[s][1];
                if (c < 0 || d < 0 || c >= width || d >= height || marks[b * width + a] == mark ||
                    marks[d * width + c] == mark)
                    continue;
                for (int i = 0; i < count; i++) {
                    places++;
                    stands += fabsf(pictures[i][y * width + x] - pictures[i][d * width + c]) > STANDS_OUT;
                }
            }
    return places ? (double)stands / (double)places : 0;
}

/* A block more on every side: its edge is blurred, and features look around themselves. */
static int widen(const uint8_t *marks, int width, int height, uint8_t mark, uint8_t *rig)
{
    int size = 0;

    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            bool near = false;
            for (int b = y - 1; b <= y + 1; b++)
                for (int a = x - 1; a <= x + 1; a++)
                    near = near || (a >= 0 && b >= 0 && a < width && b < height && marks[b * width + a] == mark);
            rig[y * width + x] = near;
            size += near;
        }
    return size;
}

int lumi_mask_find(const float *const *pictures, int count, int width, int height, uint8_t *rig)
{
    enum { MOVES, STAYS, WORLD, RIG, ASKED };
    const int size = width * height;
    uint8_t *marks = lumi_calloc((size_t)size, 1);
    int *stack = lumi_alloc((size_t)size, sizeof *stack), found = -1;

    count = count < FRAMES_MAX ? count : FRAMES_MAX;
    if (marks && stack) {
        for (int i = 0; i < size; i++)
            marks[i] = change_of(pictures, count, i) < STILL ? STAYS : MOVES;
        for (int i = 0; i < size; i++) {
            if (marks[i] != STAYS)
                continue;
            const bool large = flood(marks, width, height, i, ASKED, stack) >= SMALLEST * size;
            const uint8_t is = large && outline(pictures, count, width, height, marks, ASKED) > OUTLINE ? RIG : WORLD;
            for (int k = i; k < size; k++)
                if (marks[k] == ASKED)
                    marks[k] = is;
        }
        found = widen(marks, width, height, RIG, rig);
    }
    lumi_free(marks);
    lumi_free(stack);
    return found;
}
