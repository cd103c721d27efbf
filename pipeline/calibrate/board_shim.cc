// Chessboard corners by OpenCV.
#include "pipeline/calibrate/board_shim.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

bool shim_find_board(uint8_t *grey, int width, int height, int columns, int rows, float *corners)
{
    try {
        const cv::Mat picture(height, width, CV_8UC1, grey);
        std::vector<cv::Point2f> found;
        cv::setNumThreads(1);
        if (!cv::findChessboardCorners(picture, cv::Size(columns, rows), found,
                                       cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
            return false;
        cv::cornerSubPix(picture, found, cv::Size(5, 5), cv::Size(-1, -1),
                         cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 1e-3));
        for (size_t i = 0; i < found.size(); i++) {
            corners[2 * i] = found[i].x;
            corners[2 * i + 1] = found[i].y;
        }
        return true;
    } catch (...) {
        return false;
    }
}
