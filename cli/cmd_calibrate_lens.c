/* lumi calibrate lens: a lens from pictures of a board. */
#include "cli/command.h"
#include "pipeline/calibrate/board_lens.h"
#include "proto/base/file.h"
#include "proto/image/image.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define DEGREE 0.017453292519943295

static char *board = NULL, *model = NULL, *name = NULL, *output = NULL;

static const GOptionEntry options[] = {
    {"board", 'b', 0, G_OPTION_ARG_STRING, &board, "inner corners of the chessboard across and down, such as 9x6",
     "WxH"},
    {"model", 0, 0, G_OPTION_ARG_STRING, &model, "fisheye (default) or pinhole", "MODEL"},
    {"name", 0, 0, G_OPTION_ARG_STRING, &name, "of the lens (lens)", "NAME"},
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &output, "the lens as a section of a rig profile", "FILE"},
    {0},
};

/* What was found in the pictures. */
struct found {
    int columns, rows, width, height, count, without;
    GPtrArray *names;
    float **corners;
};

static int by_name(gconstpointer a, gconstpointer b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* A folder stands for the pictures in it. */
static int list_pictures(int argc, char **argv, GPtrArray *paths, struct lumi_error *error)
{
    for (int i = 0; i < argc; i++) {
        g_autoptr(GDir) folder = g_dir_open(argv[i], 0, NULL);
        const char *entry;
        if (!folder)
            g_ptr_array_add(paths, g_strdup(argv[i]));
        while (folder && (entry = g_dir_read_name(folder)))
            if (lumi_image_format_of_name(entry) != LUMI_IMAGE_AUTO)
                g_ptr_array_add(paths, g_build_filename(argv[i], entry, NULL));
    }
    g_ptr_array_sort(paths, by_name);
    return paths->len ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there are no pictures in it", argv[0]);
}

static int look(const char *path, struct found *found, struct lumi_error *error)
{
    float *corners = g_new(float, 2 * (gsize)found->columns * (gsize)found->rows);
    int width, height;
    int code = lumi_board_find(path, found->columns, found->rows, corners, &width, &height, error);

    if (code == LUMI_OK && found->count && (width != found->width || height != found->height))
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: is %d×%d pixels, the pictures before %d×%d", path, width, height,
                         found->width, found->height);
    if (code != LUMI_OK) {
        g_free(corners);
        if (code != LUMI_ERR_NOTFOUND || !g_file_test(path, G_FILE_TEST_EXISTS))
            return code;
        fprintf(stderr, "lumi calibrate lens: %s; left out\n", error->text);
        found->without++;
        return LUMI_OK;
    }
    found->width = width;
    found->height = height;
    found->corners[found->count++] = corners;
    g_ptr_array_add(found->names, g_path_get_basename(path));
    return LUMI_OK;
}

static void report(const struct found *found, const struct lumi_board_view *views, const struct lumi_board_lens *lens)
{
    static const char *const names[LUMI_LENS_NUMBERS] = {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2"};
    double numbers[LUMI_LENS_NUMBERS], across = 0;
    const double to_corner = hypot(lens->lens.width, lens->lens.height) / 2;

    lumi_lens_numbers(&lens->lens, numbers);
    for (int i = 0; i < found->count; i++) {
        printf("%-32s %.3f px%s\n", (char *)found->names->pdata[i], views[i].error,
               views[i].error > 2 * lens->error ? "   worse than the others: moved, or not flat?" : "");
        for (int k = 0; k < found->columns * found->rows; k++)
            across = fmax(across, hypot(views[i].corners[2 * k] - lens->lens.width / 2.0,
                                        views[i].corners[2 * k + 1] - lens->lens.height / 2.0));
    }
    printf("%d pictures, %d without a board; %.3f px root mean square\n", found->count, found->without, lens->error);
    printf("corners were seen up to %.1f° off the axis, %.0f %% of the way to the picture's corners\n",
           lens->reach / DEGREE, 100 * across / to_corner);
    for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
        if (lens->sigma[i] > 0)
            printf("%s  %.6g ± %.2g\n", names[i], numbers[i], lens->sigma[i]);
}

static int solve(const struct found *found, enum lumi_lens_model kind, struct lumi_error *error)
{
    g_autofree struct lumi_board_view *views = g_new0(struct lumi_board_view, (gsize)found->count + 1);
    struct lumi_board_lens lens;
    char text[1024];

    for (int i = 0; i < found->count; i++)
        views[i].corners = found->corners[i];
    LUMI_TRY(lumi_board_solve(kind, found->width, found->height, found->columns, found->rows, found->count, views,
                              &lens, error));
    report(found, views, &lens);
    const int length = lumi_board_print(&lens.lens, name ? name : "lens", text, sizeof text);
    if (output)
        return lumi_file_write(output, text, (size_t)length, false, error);
    printf("\n%s", text);
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    static const char *const models[] = {"fisheye", "pinhole", NULL};
    g_autoptr(GPtrArray) paths = g_ptr_array_new_with_free_func(g_free);
    struct found found = {0};
    int size[2], kind = 0, code = LUMI_OK;

    if (!board)
        return lumi_fail(error, LUMI_ERR_ARG, "--board is missing: the inner corners across and down, such as 9x6");
    LUMI_TRY(cli_parse_ints("--board", board, 'x', 2, size, error));
    if (size[0] < 3 || size[1] < 3 || size[0] > 100 || size[1] > 100 || size[0] * size[1] > LUMI_BOARD_CORNERS)
        return lumi_fail(error, LUMI_ERR_ARG, "--board %s: 3x3 to %d corners wanted", board, LUMI_BOARD_CORNERS);
    if (model)
        LUMI_TRY(cli_parse_choice("--model", model, models, &kind, error));
    if (output)
        LUMI_TRY(lumi_file_check_place(output, error));
    LUMI_TRY(list_pictures(argc, argv, paths, error));
    found.columns = size[0];
    found.rows = size[1];
    found.names = g_ptr_array_new_with_free_func(g_free);
    found.corners = g_new0(float *, paths->len);
    for (guint i = 0; i < paths->len && code == LUMI_OK; i++) {
        cli_progress("pictures", (long)i, (long)paths->len);
        code = look(paths->pdata[i], &found, error);
    }
    cli_progress_end();
    if (code == LUMI_OK)
        code = solve(&found, kind ? LUMI_LENS_BROWN : LUMI_LENS_FISHEYE, error);
    for (int i = 0; i < found.count; i++)
        g_free(found.corners[i]);
    g_free(found.corners);
    g_ptr_array_unref(found.names);
    return code;
}

const struct cli_command cli_calibrate_lens = {
    .name = "calibrate lens",
    .arguments = "PICTURES... --board WxH",
    .summary = "find a lens from pictures of a chessboard",
    .description =
        "Ten to twenty pictures (or their folder) of a flat chessboard, held still, tilted to different sides, "
        "and carried into the corners of the picture; all of one camera, with the focus of the capture. Says "
        "what is left of every picture, how far each number can be trusted and how far off the axis anything "
        "was seen. The lens is printed, or written with -o, as a section [lens NAME] of a rig profile.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = -1,
    .run = run,
};
