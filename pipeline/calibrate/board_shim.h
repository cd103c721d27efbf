/* OpenCV's chessboard corners as C: a call handed through, nothing decided. */
#ifndef LUMI_PIPELINE_CALIBRATE_BOARD_SHIM_H
#define LUMI_PIPELINE_CALIBRATE_BOARD_SHIM_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The inner corners of a chessboard, columns × rows of them, row by row: x, y in pixels, centres at integers. False:
 * there is no whole board in the picture. */
bool shim_find_board(uint8_t *grey, int width, int height, int columns, int rows, float *corners);

#ifdef __cplusplus
}
#endif
#endif
