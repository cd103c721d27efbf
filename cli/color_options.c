/* The options of `lumi process` and `lumi stage` that are about light and colour. */
#include "cli/color_options.h"

#include "pipeline/color/grade.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

struct color_options color_options;

static int check(const char *option, const double *values, int count, double least, double most,
                 struct lumi_error *error)
{
    for (int i = 0; i < count; i++)
        if (!(values[i] >= least && values[i] <= most))
            return lumi_fail(error, LUMI_ERR_ARG, "%s %g: %g to %g wanted", option, values[i], least, most);
    return LUMI_OK;
}

int color_options_read(struct lumi_parameters *parameters, struct lumi_error *error)
{
    static const char *const tones[] = {"auto", "none", "reinhard", "hable", NULL};
    const struct color_options *o = &color_options;
    int tone = LUMI_TONE_AUTO;

    parameters->response = o->response;
    parameters->icc = o->icc;
    parameters->lut = o->lut;
    if (o->icc && o->matrix)
        return lumi_fail(error, LUMI_ERR_ARG, "--icc and --color-matrix: one of them");
    if (o->matrix) {
        double *m = parameters->color_matrix;
        LUMI_TRY(cli_parse_doubles("--color-matrix", o->matrix, ',', 9, m, error));
        LUMI_TRY(check("--color-matrix", m, 9, -100, 100, error));
        double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                             m[2] * (m[3] * m[7] - m[4] * m[6]);
        if (!(fabs(determinant) > 1e-9))
            return lumi_fail(error, LUMI_ERR_ARG, "--color-matrix: colours would be lost: its determinant is 0");
    }
    if (o->balance) {
        LUMI_TRY(cli_parse_doubles("--white-balance", o->balance, ',', 3, parameters->white_balance, error));
        LUMI_TRY(check("--white-balance", parameters->white_balance, 3, 0.01, 100, error));
    }
    if (o->exposure) {
        LUMI_TRY(cli_parse_doubles("--exposure", o->exposure, ',', 1, &parameters->exposure, error));
        LUMI_TRY(check("--exposure", &parameters->exposure, 1, -20, 20, error));
    }
    if (o->tone)
        LUMI_TRY(cli_parse_choice("--tone", o->tone, tones, &tone, error));
    parameters->tone = (enum lumi_tone)tone;
    return LUMI_OK;
}

int color_options_check(const struct lumi_parameters *parameters, struct lumi_error *error)
{
    const char *response = parameters->response;
    uint8_t *data;
    size_t size;

    if (response && strcmp(response, "srgb") != 0 && strcmp(response, "linear") != 0 &&
        strcmp(response, "estimate") != 0) {
        LUMI_TRY(lumi_file_read(response, 1 << 22, &data, &size, error));
        lumi_free(data);
    }
    return lumi_grade_check(parameters, error);
}
