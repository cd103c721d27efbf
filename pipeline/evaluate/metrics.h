/* How near one picture is to another. */
#ifndef LUMI_PIPELINE_EVALUATE_METRICS_H
#define LUMI_PIPELINE_EVALUATE_METRICS_H

#include "proto/base/raster.h"
#include "proto/base/result.h"

/* Decibels above this, identical pictures included, are given as this. */
#define LUMI_PSNR_MAX 100.0

struct lumi_comparison {
    double psnr_rgb; /* 10 log10(255² / mean squared error over R, G, B) */
    double
        psnr_yuv; /* 10 log10(255² · (3/2) W H / (SSE_Y + SSE_U + SSE_V)), 4:2:0 (Overbeck et al. 2018, section 8.2) */
    double ssim;  /* Wang, Bovik, Sheikh, Simoncelli 2004: luma, 11×11 Gaussian of 1.5 pixels, mean over all places
                     where the window lies inside the picture */
};

/* Both RGB, U8, of one size: LUMI_ERR_ARG otherwise. Pictures smaller than the window have the SSIM of one window over
 * what there is. */
int lumi_compare_pictures(const struct lumi_raster *a, const struct lumi_raster *b, int threads,
                          struct lumi_comparison *comparison, struct lumi_error *error);

/* From a sum of squared errors over `samples` samples of 8 bits. */
double lumi_psnr(double sum, double samples);

/* The SSIM of two planes of floats (0..255). −2 where memory could not be had. */
double lumi_ssim(const float *a, const float *b, int width, int height, int threads);

#endif
