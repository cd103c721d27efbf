/* make_films CAPTURE OUT SCRIPT: the capture's rig as OUT.rig, and the frames of each of its cameras as a video
 * OUT/CAMERA.mkv that the camera would have recorded of one turn: between two positions its pictures fade into each
 * other, the rig's lamp lights a corner by its code at the turn's begin and end, and all cameras hear the same clicks.
 * The script:
 *
 *   rate PICTURES       a second (20)
 *   turn SECONDS        a turn takes so long (8)
 *   lead CAMERA SECONDS it recorded for so long before the turn began (2)
 *   drop CAMERA N M     M pictures from the Nth on are not in it
 *   double CAMERA N     the Nth picture is the one before
 *   break CAMERA N      half of the Nth picture's bytes are noise
 *   dark CAMERA 0       it does not see the lamp
 *   mute CAMERA 0       it has no sound */
#include "pipeline/exchange/film_lamp.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/mechanism/rig.h"
#include "tests/scenario/camera_script.h"

#include <libavformat/avformat.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define PICTURES 256
#define SOUND_RATE 8000
#define TAIL 5.0 /* s it goes on recording */

static double rate = 20, turn = 8, bit = 0.2;

static bool take_setting(const char *line)
{
    return sscanf(line, "rate %lf", &rate) == 1 || sscanf(line, "turn %lf", &turn) == 1;
}

static bool dropped(const char *camera, int number)
{
    for (int i = 0; i < script_line_count; i++) {
        const struct script_line *line = &script_lines[i];
        if (!strcmp(line->what, "drop") && !strcmp(line->camera, camera) && number >= line->a &&
            number < line->a + line->b)
            return true;
    }
    return false;
}

static bool lamp_lit(double time)
{
    for (int number = 0; number < 2; number++) {
        double half = floor((time - number * turn) / (bit / 2) + 1e-9);
        if (half >= 0 && half < 33 && lumi_lamp_code((unsigned)number) >> (int)half & 1)
            return true;
    }
    return false;
}

/* What the camera sees `time` after the turn began. */
static void mix(const struct lumi_raster *pictures, int count, double time, bool dark, struct lumi_raster *out)
{
    double at = time / turn * count, whole = floor(at);
    int first = (((int)whole % count) + count) % count;
    const struct lumi_raster *a = &pictures[first], *b = &pictures[(first + 1) % count];
    int lit = !dark && lamp_lit(time) ? 60 : 0;

    for (int y = 0; y < out->height; y++)
        for (int x = 0; x < 3 * out->width; x++) {
            double value = lumi_row_u8(a, y)[x] * (1 - at + whole) + lumi_row_u8(b, y)[x] * (at - whole);
            bool corner = x < 3 * out->width / 4 && y > 3 * out->height / 4;
            lumi_row_u8(out, y)[x] = (uint8_t)fmin(255, value + (corner ? lit : 0) + 0.5);
        }
}

struct film {
    AVFormatContext *format;
    AVStream *video, *sound;
    AVPacket *packet;
};

static int open_film(struct film *film, const char *path, int width, int height, bool mute)
{
    if (avformat_alloc_output_context2(&film->format, NULL, "matroska", path) < 0)
        return -1;
    film->format->flags |= AVFMT_FLAG_BITEXACT;
    film->video = avformat_new_stream(film->format, NULL);
    film->video->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
    film->video->codecpar->codec_id = AV_CODEC_ID_MJPEG;
    film->video->codecpar->width = width;
    film->video->codecpar->height = height;
    film->video->time_base = (AVRational){1, 1000};
    if (!mute) {
        film->sound = avformat_new_stream(film->format, NULL);
        film->sound->codecpar->codec_type = AVMEDIA_TYPE_AUDIO;
        film->sound->codecpar->codec_id = AV_CODEC_ID_PCM_S16LE;
        film->sound->codecpar->format = AV_SAMPLE_FMT_S16;
        film->sound->codecpar->sample_rate = SOUND_RATE;
        film->sound->codecpar->ch_layout = (AVChannelLayout)AV_CHANNEL_LAYOUT_MONO;
        film->sound->time_base = (AVRational){1, SOUND_RATE};
    }
    film->packet = av_packet_alloc();
    return avio_open(&film->format->pb, path, AVIO_FLAG_WRITE) < 0 ? -1 : avformat_write_header(film->format, NULL);
}

static int put(struct film *film, const AVStream *stream, const void *data, size_t size, double time)
{
    if (av_new_packet(film->packet, (int)size) < 0)
        return -1;
    memcpy(film->packet->data, data, size);
    film->packet->stream_index = stream->index;
    film->packet->pts = film->packet->dts = llround(time / av_q2d(stream->time_base));
    film->packet->flags = AV_PKT_FLAG_KEY;
    return av_interleaved_write_frame(film->format, film->packet);
}

/* Clicks at irregular moments, the same for all cameras. */
static void click(int16_t *samples, int count, double begin)
{
    for (int i = 0; i < count; i++) {
        double time = begin + (double)i / SOUND_RATE, slot = floor(time / 0.37);
        double at = 0.05 + 0.25 * fmod(fabs(slot * slot * 0.6180339887), 1), past = time - slot * 0.37 - at;
        double loud = past >= 0 && past < 0.02 ? 12000 : 60;
        samples[i] = (int16_t)(loud * sin(time * 2 * 3.14159265 * 900));
    }
}

static int write_picture(struct film *film, const char *camera, int number, double time,
                         const struct lumi_raster *raster, struct lumi_error *error)
{
    struct lumi_image_options options;
    uint8_t *data;
    size_t size;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    options.subsample = true;
    LUMI_TRY(lumi_image_encode(raster, &options, &data, &size, error));
    if (script_find("break", camera, number))
        for (size_t i = size / 2; i < size; i++)
            data[i] = (uint8_t)(i * 37);
    int code = put(film, film->video, data, size, time);
    lumi_free(data);
    return code < 0 ? lumi_fail(error, LUMI_ERR_IO, "writing a picture") : LUMI_OK;
}

static int write_film(const char *path, const char *camera, const struct lumi_raster *pictures, int count,
                      struct lumi_error *error)
{
    const struct script_line *lead = script_find("lead", camera, -1);
    double begin = -(lead ? lead->a : 2);
    int total = (int)((turn + TAIL - begin) * rate), block = (int)(SOUND_RATE / rate);
    bool mute = script_find("mute", camera, -1) != NULL;
    struct lumi_raster picture;
    struct film film = {0};
    int16_t samples[SOUND_RATE];

    LUMI_TRY(lumi_raster_create(&picture, pictures->width, pictures->height, 3, LUMI_U8));
    int code = open_film(&film, path, picture.width, picture.height, mute) < 0
                   ? lumi_fail(error, LUMI_ERR_IO, "%s: cannot be made", path)
                   : LUMI_OK;
    for (int i = 0; code == LUMI_OK && i < total; i++) {
        double time = i / rate;
        if (!script_find("double", camera, i))
            mix(pictures, count, begin + time, script_find("dark", camera, -1) != NULL, &picture);
        if (!dropped(camera, i))
            code = write_picture(&film, camera, i, time, &picture, error);
        click(samples, block, begin + time);
        if (code == LUMI_OK && !mute && put(&film, film.sound, samples, 2 * (size_t)block, time) < 0)
            code = lumi_fail(error, LUMI_ERR_IO, "%s: writing sound", path);
    }
    if (code == LUMI_OK)
        av_write_trailer(film.format);
    av_packet_free(&film.packet);
    if (film.format)
        avio_closep(&film.format->pb);
    avformat_free_context(film.format);
    lumi_raster_finish(&picture);
    return code;
}

static int write_camera(struct lumi_capture *capture, const struct lumi_capture_frame *frames, int frame_count,
                        const char *out, const char *camera, struct lumi_error *error)
{
    static struct lumi_raster pictures[PICTURES];
    int count = 0, code = LUMI_OK;
    char path[512];

    for (int i = 0; code == LUMI_OK && i < frame_count && count < PICTURES; i++) {
        if (strcmp(frames[i].camera_name, camera) != 0)
            continue;
        code = camera_script_picture(capture, &frames[i], &pictures[count++], error);
    }
    snprintf(path, sizeof path, "%s/%s.mkv", out, camera);
    if (code == LUMI_OK)
        code = write_film(path, camera, pictures, count, error);
    for (int i = 0; i < count; i++)
        lumi_raster_finish(&pictures[i]);
    return code;
}

static int begin(const char *out, const char *profile, struct lumi_error *error)
{
    struct lumi_rig rig;

    mkdir(out, 0777);
    LUMI_TRY(lumi_rig_parse(profile, strlen(profile), out, &rig, error));
    bit = rig.control.video.lamp_bit;
    return LUMI_OK;
}

int main(int argc, char **argv)
{
    const struct camera_script script = {"make_films", take_setting, begin, write_camera};

    return camera_script_run(&script, argc, argv);
}
