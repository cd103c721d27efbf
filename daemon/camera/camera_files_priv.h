/* The backend for cameras that record by themselves: a watched folder, or a memory card that comes and goes. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_FILES_PRIV_H
#define LUMI_DAEMON_CAMERA_CAMERA_FILES_PRIV_H

#include "daemon/camera/camera_device.h"

/* LUMI_ERR_NOTFOUND: the folder is not there (the card is not in). */
int camera_files_open(const char *folder, struct lumi_camera **camera, struct lumi_error *error);

#endif
