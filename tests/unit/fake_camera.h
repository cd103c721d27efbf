/* A camera of the tests' own: it does what it is told, tells what it was asked, and goes away when it is pulled. Its
 * frames carry their number. All functions may be called from any thread. */
#ifndef LUMI_TESTS_UNIT_FAKE_CAMERA_H
#define LUMI_TESTS_UNIT_FAKE_CAMERA_H

#include "daemon/camera/camera_host.h"

struct fake_camera; /* what is plugged and pulled; cameras opened on it are lumi_camera */
struct fake_camera *fake_camera_new(const char *serial);
void fake_camera_delete(struct fake_camera *fake);
int fake_camera_open(void *fake, struct lumi_camera **camera, struct lumi_error *error); /* lumi_camera_open_fn */

void fake_camera_plug(struct fake_camera *fake, bool there);
void fake_camera_make_frames(struct fake_camera *fake, int count); /* come when it is armed */
void fake_camera_keeps(struct fake_camera *fake);                  /* one that records by itself, before it is opened */
void fake_camera_fail(struct fake_camera *fake, int code);         /* the next frame asked for fails with it, once */
/* What was asked of it, a letter each: O open, C configure, A arm, D disarm, T trigger, E expose, X close. */
void fake_camera_story(struct fake_camera *fake, char *story, size_t size);
struct lumi_camera_setting fake_camera_setting(struct fake_camera *fake);
double fake_camera_exposure(struct fake_camera *fake);

#endif
