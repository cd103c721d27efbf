/* ICC profiles through Little CMS 2. */
#include "pipeline/color/icc.h"

#include "proto/base/memory.h"
#include "proto/base/raster.h"

#include <lcms2.h>
#include <math.h>
#include <string.h>

/* XYZ of the D50 connection space to linear sRGB: the inverse of the primaries of IEC 61966-2-1 adapted by Bradford's
 * matrix, as Lindbloom computed it. */
static const double from_xyz[9] = {3.1338561, -1.6168667, -0.4906146, -0.9787684, 1.9161415,
                                   0.0334540, 0.0719453,  -0.2289914, 1.4052427};

struct lumi_icc {
    cmsHTRANSFORM transform; /* NULL: the matrix */
    double matrix[9];
};

static bool read_matrix(cmsHPROFILE profile, double matrix[9])
{
    static const cmsTagSignature tags[3] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
    double sums[3];

    for (int c = 0; c < 3; c++) {
        const cmsCIEXYZ *xyz = cmsReadTag(profile, tags[c]);
        if (!xyz || !(fabs(xyz->X) < 10 && fabs(xyz->Y) < 10 && fabs(xyz->Z) < 10))
            return false;
        for (int row = 0; row < 3; row++)
            matrix[3 * row + c] =
                from_xyz[3 * row] * xyz->X + from_xyz[3 * row + 1] * xyz->Y + from_xyz[3 * row + 2] * xyz->Z;
    }
    /* White stays white: profiles round their numbers. */
    for (int row = 0; row < 3; row++) {
        sums[row] = matrix[3 * row] + matrix[3 * row + 1] + matrix[3 * row + 2];
        for (int c = 0; c < 3 && fabs(sums[row] - 1) < 0.02; c++)
            matrix[3 * row + c] /= sums[row];
    }
    return true;
}

static cmsHPROFILE linear_srgb(void)
{
    cmsCIExyY white = {0.3127, 0.3290, 1};
    cmsCIExyYTRIPLE primaries = {{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}};
    cmsToneCurve *curve = cmsBuildGamma(NULL, 1), *curves[3] = {curve, curve, curve};
    cmsHPROFILE profile = curve ? cmsCreateRGBProfile(&white, &primaries, curves) : NULL;

    cmsFreeToneCurve(curve);
    return profile;
}

static int open_transform(cmsHPROFILE profile, const char *name, struct lumi_icc *icc, struct lumi_error *error)
{
    cmsHPROFILE display = linear_srgb();

    if (!display)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for the display's profile", name);
    icc->transform = cmsCreateTransform(profile, TYPE_RGB_FLT, display, TYPE_RGB_FLT, INTENT_RELATIVE_COLORIMETRIC,
                                        cmsFLAGS_NOCACHE);
    cmsCloseProfile(display);
    if (!icc->transform)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no transform can be made of this profile", name);
    return LUMI_OK;
}

int lumi_icc_create(const void *data, size_t size, const char *name, bool linear, struct lumi_icc **result,
                    struct lumi_error *error)
{
    struct lumi_icc *icc = lumi_calloc(1, sizeof *icc);
    cmsHPROFILE profile = NULL;
    int code = LUMI_OK;

    *result = NULL;
    if (!icc)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for it", name);
    if (size < UINT32_MAX)
        profile = cmsOpenProfileFromMem(data, (cmsUInt32Number)size);
    if (!profile)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: no ICC profile", name);
    else if (cmsGetColorSpace(profile) != cmsSigRgbData)
        code = lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: a profile of something else than RGB", name);
    else if (linear && (!cmsIsMatrixShaper(profile) || !read_matrix(profile, icc->matrix)))
        code = lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "%s: a profile without a matrix says nothing of pictures in linear light", name);
    else if (!linear)
        code = open_transform(profile, name, icc, error);
    if (profile)
        cmsCloseProfile(profile);
    if (code != LUMI_OK) {
        lumi_icc_destroy(icc);
        return code;
    }
    *result = icc;
    return LUMI_OK;
}

void lumi_icc_destroy(struct lumi_icc *icc)
{
    if (!icc)
        return;
    if (icc->transform)
        cmsDeleteTransform(icc->transform);
    lumi_free(icc);
}

void lumi_icc_apply(const struct lumi_icc *icc, float *pixels, size_t count)
{
    if (icc->transform) {
        for (size_t i = 0; i < 3 * count; i++)
            pixels[i] = lumi_srgb_encode(pixels[i]);
        cmsDoTransform(icc->transform, pixels, pixels, (cmsUInt32Number)count);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        const double in[3] = {(double)pixels[3 * i], (double)pixels[3 * i + 1], (double)pixels[3 * i + 2]};
        for (int row = 0; row < 3; row++)
            pixels[3 * i + (size_t)row] = (float)(icc->matrix[3 * row] * in[0] + icc->matrix[3 * row + 1] * in[1] +
                                                  icc->matrix[3 * row + 2] * in[2]);
    }
}
